"""The path at times within a step, and commands that come late: against closed forms."""

import numpy as np
import pytest
from scipy.integrate import quad

from bns.engine.pose_filter import followed, slope
from bns.physics.wheels.scans import delayed, first_order

TAU_S, STEP_S, SPEED, TURN = 0.08, 0.1, 0.4, 1.5


def lagged(u, t):
    """Way of a wheel that follows a jump at 0 to u with a lag."""
    return u * (t - TAU_S * (1 - np.exp(-t / TAU_S)))


def path(speeds, t_s, step_s=STEP_S, turns=None):
    """Poses at times of one trial with these mean velocities."""
    speeds = np.asarray(speeds, float)[None]
    nothing, turns = np.zeros_like(speeds), np.zeros_like(speeds) if turns is None else np.asarray(turns, float)[None]
    steps = np.broadcast_to(np.asarray(step_s, float), speeds.shape).copy()
    t_s = np.asarray(t_s, float)
    return followed(steps, speeds, nothing, turns, nothing, np.zeros(len(t_s), np.int64), t_s)[0]


def test_within_a_step_a_wheel_that_speeds_up_is_where_it_is():
    """Straight between the ends of steps it would be 1 mm off."""
    ends = np.arange(13) * STEP_S
    means = np.diff(lagged(SPEED, ends)) / STEP_S
    off_nodes = np.linspace(0.13, 1.0, 40)
    straight = np.interp(off_nodes, ends, lagged(SPEED, ends)) - lagged(SPEED, off_nodes)
    error = path(means, off_nodes)[:, 0] - lagged(SPEED, off_nodes)
    assert np.abs(straight).max() > 9e-4
    assert np.abs(error).max() < 0.4 * np.abs(straight).max()
    assert abs(error.mean()) < 0.1 * straight.mean()
    np.testing.assert_allclose(path(means, ends[1:])[:, 0], lagged(SPEED, ends[1:]), atol=1e-12)


def test_headings_within_a_step_likewise():
    ends = np.arange(13) * STEP_S
    means = np.diff(lagged(TURN, ends)) / STEP_S
    off_nodes = np.linspace(0.13, 1.0, 40)
    straight = np.interp(off_nodes, ends, lagged(TURN, ends)) - lagged(TURN, off_nodes)
    error = path(0 * means, off_nodes, turns=means)[:, 2] - lagged(TURN, off_nodes)
    assert abs(error.mean()) < 0.1 * straight.mean()


def test_headings_rise_with_the_turns_alone_where_only_these_change():
    """A steady forward speed; the turn rate rises steadily, so that its integral is known everywhere."""
    rise, ends = 0.9, np.arange(9) * STEP_S
    means = rise * (ends[1:] + ends[:-1]) / 2
    t = np.linspace(STEP_S, ends[-2], 61)
    poses = path(np.full(8, SPEED), t, turns=means)
    np.testing.assert_allclose(poses[:, 2], rise * t**2 / 2, atol=1e-12)
    fine = np.linspace(0.0, ends[-1], 80001)
    heading = rise * fine**2 / 2
    for column, rate in enumerate((np.cos(heading), np.sin(heading))):
        way = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2)]) * SPEED * fine[1]
        np.testing.assert_allclose(poses[:, column], np.interp(t, fine, way), atol=1e-3)


def test_times_that_go_back_within_a_trial_are_followed_from_its_begin():
    speeds, turns = [0.2, 0.3, 0.4, 0.5], [0.5, 0.4, 0.2, 0.1]
    t = np.array([0.05, 0.32, 0.21, 0.39, 0.02])
    alone = np.concatenate([path(speeds, [one], turns=turns) for one in t])
    np.testing.assert_allclose(path(speeds, t, turns=turns), alone, atol=1e-15)


@pytest.mark.parametrize("speeds", [[0.2, 0.2, 0.5, 0.5, -0.1, -0.1], [0.3, 0.1, 0.4, 0.0, 0.2, -0.2]])
def test_what_jumps_at_the_ends_of_steps_stays_as_it_is(speeds):
    """Constant over two steps each, or up and down: no neighbour says how a speed changes within its step."""
    t = np.linspace(0.0, 0.6, 50)
    ways = np.concatenate([[0.0], np.cumsum(speeds) * STEP_S])
    np.testing.assert_allclose(path(speeds, t)[:, 0], np.interp(t, np.arange(7) * STEP_S, ways), atol=1e-12)


def test_a_steady_rise_has_its_own_slope_and_none_at_the_ends():
    steps = np.array([[0.1, 0.1, 0.3, 0.1, 0.0]])
    middle = np.cumsum(steps, axis=1) - steps / 2
    rise = 0.7 * middle
    assert [slope(rise, steps, 0, k) for k in range(5)] == pytest.approx([0.0, 0.7, 0.7, 0.0, 0.0])
    falls = np.where(np.arange(5) > 2, -rise, rise)
    assert slope(falls, steps, 0, 2) == 0.0


def test_a_late_command_before_and_behind_a_lag_is_the_same_in_coarse_steps():
    """Behind the lag; before it, a step that the command reaches in its middle counts as driven at the mean throughout."""
    late_s, steps = 0.077, np.full((1, 14), STEP_S)
    told = np.full((1, 14), SPEED)
    ends = np.cumsum(steps[0])
    true = np.array([lagged(SPEED, max(t - late_s, 0.0)) for t in ends])
    behind = np.cumsum(delayed(first_order(told, steps, TAU_S), steps, late_s, True)[0]) * STEP_S
    before = np.cumsum(first_order(delayed(told, steps, late_s, False), steps, TAU_S)[0]) * STEP_S
    assert np.abs(before - true).max() > 2e-3
    assert np.abs(behind - true)[1:].max() < 3e-4  # 0.8 mm without the slopes within steps


@pytest.mark.parametrize("varying", [False, True])
def test_a_late_jump_is_exact(varying):
    steps = np.array([[0.1, 0.1, 0.05, 0.15, 0.1, 0.1]])
    told = np.array([[0.3, 0.3, -0.2, -0.2, 0.5, 0.5]])
    ends, late_s = np.cumsum(steps[0]), 0.037

    def speed(t):
        return 0.0 if t < 0 else told[0][min(int(np.searchsorted(ends, t, side="right")), 5)]

    begins = np.concatenate([[0.0], ends[:-1]])
    true = [quad(lambda t: speed(t - late_s), a, b, points=[x + late_s for x in (0.0, *ends) if a < x + late_s < b])[0]
            for a, b in zip(begins, ends, strict=True)]  # fmt: skip
    np.testing.assert_allclose(delayed(told, steps, late_s, varying)[0] * steps[0], true, atol=1e-9)
