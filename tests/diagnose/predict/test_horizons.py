"""Windows begin and end at the times that they are named after, and errors there are those of the motion between."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.predict.base import Steps
from bns.diagnose.predict.horizons import HORIZONS, Errors, errors_of, laid_paths, windows
from bns.engine.pose_filter import displacements
from tests.diagnose.worlds import FRAME_S, NOMINAL, measured

DRIFT_M = (0.003, -0.002)


@pytest.fixture(scope="module")
def tracks():
    return tracks_of(measured(NOMINAL, trials=3, commands=8, seed=2, noise=(0.0, 0.0), jitter=0.0))


def drifting(tracks):
    """Each frame carries the robot on by `DRIFT_M`, east and north, and the rest is its own motion."""
    drift = np.where(tracks.is_first[:, None], 0.0, DRIFT_M)
    own = tracks.pose.copy()
    own[:, :2] -= np.cumsum(drift, axis=0)
    return Steps(displacements(own, tracks.is_first), drift)


def test_windows_of_commands_end_at_the_very_frames_at_which_commands_do(tracks):
    start, end = windows(tracks, "command")
    for trial in range(len(tracks)):
        ends = np.cumsum(tracks.duration_s[trial][tracks.duration_s[trial] > 0])
        begins = np.concatenate([[0.0], ends[:-1]])
        own = tracks.trial[start] == trial
        np.testing.assert_allclose(tracks.t_s[start[own]], begins, atol=1e-9)
        np.testing.assert_allclose(tracks.t_s[end[own]], ends, atol=1e-9)


def test_windows_of_a_second_begin_and_end_at_whole_seconds(tracks):
    start, end = windows(tracks, "1s")
    np.testing.assert_allclose(tracks.t_s[start] % 1.0, 0.0, atol=1e-9)
    np.testing.assert_allclose(tracks.t_s[end] - tracks.t_s[start], 1.0, atol=1e-9)
    longest = [tracks.t_s[tracks.trial == trial].max() for trial in range(len(tracks))]
    assert len(start) == sum(int(seconds + FRAME_S / 2) for seconds in longest)


@pytest.mark.parametrize("horizon", HORIZONS)
def test_a_true_model_of_a_robot_that_is_carried_along_has_no_error_in_any_trial(tracks, horizon):
    predictor = SimpleNamespace(tracks=tracks, windows=lambda name: windows(tracks, name))
    errors = errors_of(predictor, drifting(tracks), horizon)
    assert set(errors.trial) == {0, 1, 2}
    np.testing.assert_allclose(errors.position_m, 0.0, atol=1e-9)
    np.testing.assert_allclose(errors.heading_rad, 0.0, atol=1e-9)


def test_the_path_of_a_true_model_lies_on_the_track_in_every_trial(tracks):
    np.testing.assert_allclose(laid_paths(tracks, drifting(tracks)), tracks.pose, atol=1e-9)


def test_the_standard_error_is_that_of_trials_as_wholes():
    """Windows of a trial are off by the same: only the trials, all equally long, are independent."""
    rng, trials, each = np.random.default_rng(4), 50, 6
    off = np.repeat(0.02 * (1 + 0.05 * rng.normal(size=trials)), each)
    angle, frames = rng.uniform(0, 2 * np.pi, len(off)), np.arange(len(off))
    errors = Errors(np.repeat(np.arange(trials), each), frames, frames + 1, off * np.cos(angle), off * np.sin(angle), 0 * off)
    found = errors.summary(trials)
    assert found["position_m"] == pytest.approx(np.sqrt((off**2).mean()), rel=1e-12)
    assert found["position_se_m"] == pytest.approx(off[::each].std() / np.sqrt(trials), rel=0.02)
