"""Lost poses are told from commands in rows of their own, and from frames that come at uneven times."""

import numpy as np
import pytest

from bns.diagnose.data import checks
from bns.diagnose.data.checks import poses_lost, rows_of_losses

FRAMES = 440


def rows(frames_s, gone, commands_s):
    """Times of the rows, and which hold a pose: every frame has a row, and every command."""
    t_s = np.concatenate([frames_s, commands_s])
    tracked = np.concatenate([~gone, np.zeros(len(commands_s), dtype=bool)])
    order = np.argsort(t_s, kind="stable")
    return t_s[order], tracked[order]


def commands_until(end_s, rng, low=0.4, high=2.0):
    """A command at 0, and others until the end."""
    t_s = np.cumsum(rng.uniform(low, high, int(end_s / low)))
    return np.concatenate([[0.0], t_s[t_s < end_s]])


NONE = np.zeros(FRAMES, dtype=bool)


@pytest.mark.parametrize("first_s", [0.003, 0.039, 0.04, 0.0401, 0.079])
def test_the_command_that_begins_a_trial_is_no_lost_pose(first_s):
    """The first frame may come a whole interval later."""
    frames = first_s + 0.04 * np.arange(FRAMES)
    t_s, tracked = rows(frames, NONE, commands_until(frames[-1], np.random.default_rng(0)))
    assert poses_lost(t_s, tracked)[0] == 0
    assert not rows_of_losses(t_s, tracked).any()


def test_the_command_that_ends_a_trial_is_no_lost_pose():
    frames = 0.01 + 0.04 * np.arange(FRAMES)
    t_s, tracked = rows(frames, NONE, np.array([0.0, 3.003, frames[-1] + 0.04]))
    assert poses_lost(t_s, tracked)[0] == 0


def test_poses_lost_before_the_first_one_are_found_beside_commands():
    frames = 0.04 * np.arange(1, FRAMES + 1)
    t_s, tracked = rows(frames, np.arange(FRAMES) < 3, commands_until(frames[-1], np.random.default_rng(0)))
    lost, first = poses_lost(t_s, tracked)
    assert 2 <= lost <= 3  # one row of four is the first command's
    assert first == 0


@pytest.mark.parametrize("jitter", [0.0, 0.02, 0.05])
def test_lost_poses_of_an_even_tracker_are_found(jitter):
    """Each of them, however the stamps jitter by a few hundredths of a frame."""
    rng = np.random.default_rng(4)
    frames = 0.01 + 0.04 * (np.arange(FRAMES) + jitter * rng.normal(size=FRAMES))
    gone = np.arange(FRAMES) % 30 == 7
    t_s, tracked = rows(frames, gone, commands_until(frames[-1], rng))
    assert poses_lost(t_s, tracked)[0] == pytest.approx(gone.sum(), abs=1)


def test_most_lost_poses_are_found_where_stamps_jitter_more():
    """By a tenth of a frame."""
    rng, found = np.random.default_rng(4), 0
    gone = np.arange(FRAMES) % 30 == 7
    for _ in range(20):
        frames = 0.02 + 0.04 * np.arange(FRAMES) + 0.004 * rng.normal(size=FRAMES)
        found += poses_lost(*rows(frames, gone, commands_until(frames[-1], rng)))[0]
    assert 0.6 * 20 * gone.sum() <= found <= 20 * gone.sum()


def with_false_losses(waits, commands=(0.1, 0.1001), trials=40):
    """How many of some trials seem to lose poses, though none is lost."""
    rng, found = np.random.default_rng(1), 0
    for _ in range(trials):
        frames = 0.01 + np.cumsum(waits(rng))
        found += poses_lost(*rows(frames, NONE, commands_until(frames[-1], rng, *commands)))[0] > 0
    return found


def gamma(rng):
    return 0.012 + rng.gamma(1.5, 0.01, FRAMES)


def test_frames_that_wait_a_random_time_are_not_lost(monkeypatch):
    """Long gaps are the tail of what the short ones show; a rule of the usual length alone calls nearly every trial faulty."""
    assert with_false_losses(gamma) <= 8
    assert with_false_losses(gamma, (0.4, 2.0)) == 0
    monkeypatch.setattr(checks, "_BY_CHANCE", float(FRAMES))
    assert with_false_losses(gamma) >= 20


def test_gaps_count_by_how_rarely_they_are_whole():
    """Rows of commands every 65 ms leave few long gaps whole; those that are left count the more, else 21 trials seem faulty."""
    assert with_false_losses(lambda rng: 0.03 + rng.exponential(0.01, FRAMES), (0.065, 0.0651)) <= 12


def test_where_commands_leave_no_usual_gap_whole_all_gaps_are_looked_at(monkeypatch):
    """Frames every 30 to 100 ms, commands every 50 ms: the gaps without a row are all short."""

    def waits(rng):
        return rng.uniform(0.03, 0.1, FRAMES)

    assert with_false_losses(waits, (0.05, 0.0501)) <= 6
    monkeypatch.setattr(checks, "_TYPICAL", 0.0)
    assert with_false_losses(waits, (0.05, 0.0501)) >= 20


def test_a_long_stretch_without_poses_is_found_whenever_frames_come():
    rng = np.random.default_rng(1)
    frames = 0.01 + np.cumsum(gamma(rng))
    gone = (np.arange(FRAMES) >= 200) & (np.arange(FRAMES) < 215)
    t_s, tracked = rows(frames, gone, commands_until(frames[-1], rng))
    lost, first = poses_lost(t_s, tracked)
    assert lost >= 10
    assert t_s[first] == pytest.approx(frames[200], abs=0.1)
    assert rows_of_losses(t_s, tracked).sum() >= 15
