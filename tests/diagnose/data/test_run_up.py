"""One long log cut anywhere: each piece takes along the real seconds before it, and its times are its own."""

import numpy as np
import pandas as pd
import pytest

import bns
from bns.diagnose.data.split_trials import split
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.predict.wheels import WheelPredictor
from bns.physics.wheels.differential_drive import observe, track
from tests.diagnose.worlds import NOMINAL, hidden

LIMITED = hidden(acceleration_limit={"max_m_s2": 0.15})
MINUTES = 12


def long_log(model, seed=1, noise=(0.0015, 0.005), minutes=MINUTES):
    """A drive without a stop, of commands of 0.4 to 2 s, seen by a camera at 10 Hz."""
    rng = np.random.default_rng(seed)
    duration = np.round(rng.uniform(0.4, 2.0, 2000) / 0.1) * 0.1
    duration = duration[: np.searchsorted(np.cumsum(duration), 60 * minutes)]
    left, right = rng.uniform(-0.2, 0.2, (2, len(duration)))
    seen = track(model, [left], [right], [duration], dense_dt_s=0.1, start=[0, 0, 0.3])
    poses = observe(seen.poses[0], None, model)
    poses = poses + rng.normal(size=poses.shape) * [noise[0], noise[0], noise[1]]
    t = seen.t_s[0]
    force = np.minimum(np.searchsorted(np.cumsum(duration), t + 1e-9, side="right"), len(duration) - 1)
    columns = {"t_s": t, "left_m_s": left[force], "right_m_s": right[force]}
    return pd.DataFrame({**columns, "x_m": poses[:, 0], "y_m": poses[:, 1], "heading_rad": poses[:, 2]})


@pytest.fixture(scope="module")
def log():
    return long_log(LIMITED)


@pytest.fixture(scope="module")
def pieces(log):
    return split(log, "lasting_s", 20.0)


def test_a_piece_is_predicted_as_the_same_seconds_of_the_whole_log():
    log = long_log(LIMITED, noise=(0.0, 0.0), minutes=2)
    whole = WheelPredictor(tracks_of(log.assign(trial=0))).steps(LIMITED).body
    cut = tracks_of(split(log, "lasting_s", 20.0))
    steps = WheelPredictor(cut).steps(LIMITED).body
    inner = ~cut.is_first
    np.testing.assert_allclose(steps[inner], whole[inner], atol=2e-4)


def test_times_are_those_of_the_piece(pieces, log):
    tracks = tracks_of(pieces)
    assert tracks.own_s.min() == 0
    assert 19.8 < np.median(tracks.own_s[tracks.first[1:] - 1]) < 20
    session = tracks.start_s[tracks.trial] + tracks.t_s
    np.testing.assert_allclose(session, log["t_s"], atol=1e-6)
    moved = log.copy()
    moved["x_m"] += 0.06 * np.clip(moved["t_s"] - 310.0, 0.0, 1.0)  # somebody pushed it
    seen = bns.compare(split(moved, "lasting_s", 20.0), LIMITED)
    worst = seen.worst.iloc[0]
    begun = 20.0 * int(worst["trial"])
    assert begun + worst["t_s"] == pytest.approx(310.0, abs=1.0)


@pytest.mark.slow
def test_a_long_log_with_an_acceleration_limit_is_none_against_the_model_that_has_it(pieces):
    assert bns.diagnose(pieces, LIMITED).verdict == "none"


@pytest.mark.slow
def test_against_the_drawing_it_is_the_limit_and_nothing_else(pieces):
    found = bns.diagnose(pieces, NOMINAL)
    assert found.verdict == "effects"
    assert found.effects == ("acceleration-limit",)
    row = found.parameters.iloc[0]
    assert row["low"] < 0.15 < row["high"]


def test_rows_taken_along_are_no_lost_poses_and_no_evidence(pieces, log):
    read = bns.Measurements(pieces)
    assert not read.findings["text"].str.contains("lost|no row").any()
    assert read.trials["poses"].sum() == len(log)
    assert read.trials["duration_s"].iloc[1] == pytest.approx(20.0, abs=0.2)
