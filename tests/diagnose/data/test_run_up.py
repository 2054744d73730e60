"""One long log cut anywhere: each piece takes along the real seconds before it, and its times are its own."""

import numpy as np
import pandas as pd
import pytest

import bns
from bns.cli.main import main
from bns.diagnose.data.split_trials import split
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.predict.wheels import WheelPredictor
from bns.errors import DataError
from bns.measurements import COMMANDS, POSE
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


def test_where_nothing_was_logged_for_longer_than_a_piece_there_is_none(log):
    """Of 60 s in pieces of 5 s, those from 20 to 40 s."""
    minute = log[log.t_s < 60.0]
    pieces = split(minute[(minute.t_s < 18.0) | (minute.t_s > 42.0)].reset_index(drop=True), "lasting_s", 5.0)
    whole = set(split(minute.reset_index(drop=True), "lasting_s", 5.0).trial)
    assert whole - set(pieces.trial) == {4, 5, 6, 7}
    assert pieces.groupby("trial").t_s.max().max() < 10.0  # what is left at the end is part of the last


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


def test_trials_that_are_there_are_cut_each_by_itself(log):
    """Two of 65 s, times from the beginning of each, and one of 12 s that remains whole."""
    first, second, short = (log[(log["t_s"] >= a) & (log["t_s"] < b)] for a, b in ((0.0, 65.0), (100.0, 165.0), (200.0, 212.0)))
    named = zip("ABC", (first, second, short), strict=True)
    parts = [one.assign(trial=name, t_s=one["t_s"] - one["t_s"].iloc[0]) for name, one in named]
    cut = split(pd.concat(parts, ignore_index=True), "lasting_s", 20.0)
    assert list(cut["trial"].unique()) == ["A-0", "A-1", "A-2", "B-0", "B-1", "B-2", "C"]
    alone = split(parts[1].drop(columns="trial").reset_index(drop=True), "lasting_s", 20.0)
    own = cut[cut["trial"].str.startswith("B")].reset_index(drop=True)
    pd.testing.assert_frame_equal(own[["t_s", *POSE, *COMMANDS, "run_up"]], alone[["t_s", *POSE, *COMMANDS, "run_up"]])
    assert "session_s" not in cut  # times start again with each trial
    with pytest.raises(DataError, match=r"cuts none of the 1 trials"):
        split(parts[2], "lasting_s", 20.0)


def test_what_trials_cannot_be_cut_is_said_and_nothing_is_lost(log):
    """Rows of no trial stay, for the checks to speak of; one in which the robot stands is left out, as is standing elsewhere."""
    two = pd.concat([log[log["t_s"] < 50].assign(trial=name) for name in (1.0, 2.0)], ignore_index=True)
    for column in ("run_up", "before_left_m_s"):
        with pytest.raises(DataError, match=rf"^{column}: these columns say how the trials"):
            split(two.assign(**{column: 0.0}), "lasting_s", 20.0)
    back = two.assign(t_s=two["t_s"].where(two.index != two.index[-5], 0.0))
    with pytest.raises(DataError, match=r"Trial 2: Row \d+: t_s runs backwards"):
        split(back, "lasting_s", 20.0)
    nowhere = two.assign(trial=two["trial"].where(two.index > 3))
    assert split(nowhere, "lasting_s", 20.0)["trial"].isna().sum() == 4
    stands = two.assign(**{name: two[name].where((two["trial"] == 1.0) & ~two["t_s"].between(20, 25), 0.0) for name in COMMANDS})
    assert list(split(stands, "standing_s", 2.0)["trial"].unique()) == ["1-0", "1-1"]


def test_a_mapping_may_cut_trials_that_have_names(log, tmp_path):
    log[log["t_s"] < 130].assign(trial="A").to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "map.yaml").write_text("columns: {trial: {from: trial}}\ntrials: {lasting_s: 20}\n")
    out = tmp_path / "cut.csv"
    assert main(["import", str(tmp_path / "log.csv"), "--map", str(tmp_path / "map.yaml"), "-o", str(out)]) == 0
    assert list(pd.read_csv(out)["trial"].unique()) == [f"A-{k}" for k in range(6)]


@pytest.mark.parametrize(("each_s", "pieces"), [(130.0, 18), (41.0, 6), (39.0, 0)])
def test_few_trials_that_last_long_may_be_cut(log, each_s, pieces):
    table = pd.concat(
        [log[log["t_s"] < each_s].assign(trial=k, t_s=lambda one: one["t_s"] + 1e-9) for k in range(3)], ignore_index=True
    )
    (note,) = bns.diagnose(table, LIMITED).notes
    assert note.startswith("3 trials: anything they show could be due to chance.")
    assert (f"the same drives are {pieces} trials." in note) == bool(pieces)
    assert ("in a mapping of bns import" in note) == bool(pieces)


@pytest.fixture(scope="module")
def some(pieces):
    """Half of them: enough for a diagnosis."""
    return pieces[pieces["trial"].isin(pieces["trial"].unique()[:18])].reset_index(drop=True)


@pytest.mark.slow
def test_a_long_log_with_an_acceleration_limit_is_none_against_the_model_that_has_it(some):
    assert bns.diagnose(some, LIMITED).verdict == "none"


@pytest.mark.slow
def test_against_the_drawing_it_is_the_limit_and_nothing_else(some):
    found = bns.diagnose(some, NOMINAL)
    assert found.verdict == "effects"
    assert found.effects == ("acceleration-limit",)
    row = found.parameters.iloc[0]
    assert row["low"] < 0.15 < row["high"]


def test_rows_taken_along_are_no_lost_poses_and_no_evidence(pieces, log):
    read = bns.Measurements(pieces)
    assert not read.findings["text"].str.contains("lost|no row").any()
    assert read.trials["poses"].sum() == len(log)
    assert read.trials["duration_s"].iloc[1] == pytest.approx(20.0, abs=0.2)
