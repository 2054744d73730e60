"""Dry friction on motors: the exact recurrence against motors in small steps, and against what can be worked out by hand."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bns.physics.model import Model
from bns.physics.wheels.differential_drive import simulate
from bns.physics.wheels.friction import braked_together
from bns.physics.wheels.scans import first_order
from tests.hidden_effects.cause import Moment
from tests.hidden_effects.listed_loads import GearFriction

RNG = np.random.default_rng(5)
STEPS = RNG.uniform(0.02, 0.4, (2, 40))
STEPS[1, 7] = 0.0
LEFT, RIGHT = (RNG.uniform(-0.3, 0.3, (2, 40)) * (RNG.random((2, 40)) < 0.7) for _ in range(2))


@pytest.mark.parametrize(
    ("ratio", "friction", "loss"),
    [(1.0, 0.05, 0.0), (1.0, 0.2, 0.03), (0.3, 0.05, 0.02), (0.3, 0.15, 0.0), (4.0, 0.05, 0.05), (4.0, 0.15, 0.01)],
)
def test_it_is_two_motors_on_one_body_with_dry_friction(ratio, friction, loss):
    """Solved by scipy, with friction as a steep slope near rest: 0.1 mm of way in each step."""
    tau_s, row = 0.15, 0
    ends = np.cumsum(STEPS[row])

    def motors(t, state):
        k = min(np.searchsorted(ends, t, side="right"), len(ends) - 1)
        told, wheels = np.array([LEFT[row, k], RIGHT[row, k]]), state[2:]
        pushed = told + (friction - loss) * np.sign(told) - wheels - friction * np.tanh(wheels / 2e-5)
        mean, half = pushed.mean() / tau_s, (pushed[1] - pushed[0]) / 2 / tau_s / ratio
        return [*wheels, mean - half, mean + half]

    def slopes(_t, state):
        rate, other = ((1 + sign / ratio) / 2 / tau_s for sign in (1, -1))
        steep = np.diag(-1 - friction / 2e-5 * (1 - np.tanh(state[2:] / 2e-5) ** 2))
        of_wheels = np.array([[rate, other], [other, rate]]) @ steep
        return np.block([[np.zeros((2, 2)), np.eye(2)], [np.zeros((2, 2)), of_wheels]])

    how = {"method": "Radau", "jac": slopes, "max_step": 1e-2, "rtol": 1e-6, "atol": 1e-8, "t_eval": ends}
    solved = solve_ivp(motors, (0, ends[-1]), np.zeros(4), **how)
    found = np.stack(braked_together(LEFT, RIGHT, STEPS, tau_s, ratio, friction, loss))[:, row] * STEPS[row]
    np.testing.assert_allclose(found, np.diff(solved.y[:2], prepend=0.0), atol=1e-4)


def test_without_friction_it_is_a_lag_of_the_mean_and_one_of_the_difference():
    mean, half = first_order((LEFT + RIGHT) / 2, STEPS, 0.2), first_order((RIGHT - LEFT) / 2, STEPS, 0.1)
    left, right = braked_together(LEFT, RIGHT, STEPS, 0.2, 0.5, 0.0, 0.0)
    np.testing.assert_allclose([left, right], [mean - half, mean + half], atol=1e-14)
    for told, driven in zip((LEFT, RIGHT), braked_together(LEFT, RIGHT, STEPS, 0.0, 1.0, 0.0, 0.0), strict=True):
        np.testing.assert_array_equal(driven, np.where(STEPS > 0.0, told, 0.0))


def test_steps_may_be_cut_anywhere():
    cut = np.sort(np.concatenate([np.cumsum(STEPS[0]), RNG.uniform(0.0, STEPS[0].sum(), 300)]))
    steps = np.diff(cut, prepend=0.0)[None]
    of = np.minimum(np.searchsorted(np.cumsum(STEPS[0]), cut - 1e-12), 39)
    values = 0.15, 0.4, 0.1, 0.02
    whole = np.cumsum(np.stack(braked_together(LEFT[:1], RIGHT[:1], STEPS[:1], *values))[:, 0] * STEPS[0], axis=1)
    parts = np.cumsum(np.stack(braked_together(LEFT[:1, of], RIGHT[:1, of], steps, *values))[:, 0] * steps[0], axis=1)
    np.testing.assert_allclose(parts[:, np.searchsorted(cut, np.cumsum(STEPS[0]) - 1e-12)], whole, atol=1e-9)


def alone(told, steps, *values):
    """Mean speeds of a wheel beside one that is told the same: both turn alike."""
    return braked_together(np.array([told]), np.array([told]), np.array([steps]), *values)[1][0]


def test_a_wheel_coasts_for_tau_times_the_logarithm_of_its_speed_over_that_of_friction_and_then_stands():
    way = alone([0.2, 0.0, 0.0], [3.0, 1.0, 1.0], 0.1, 0.7, 0.05, 0.0) * [3.0, 1.0, 1.0]
    stop_s = 0.1 * np.log(1 + 0.2 / 0.05)
    assert way[0] == pytest.approx(0.2 * (3.0 - 0.1), abs=1e-9)  # what made up for friction left a plain lag
    assert way[1] == pytest.approx(0.1 * 0.2 - 0.05 * stop_s)
    assert way[2] == 0.0


@pytest.mark.parametrize(("told", "driven"), [(0.2, 0.17), (-0.2, -0.17), (0.02, 0.0)])
def test_a_steady_command_lacks_what_nothing_makes_up_for(told, driven):
    assert alone([told, told], [2.0, 1.0], 0.1, 1.0, 0.05, 0.03)[1] == pytest.approx(driven, abs=1e-6)


@pytest.mark.parametrize("ratio", [0.3, 1.0, 4.0])
def test_a_wheel_that_friction_holds_is_moved_by_the_body_only_where_turns_are_heavy_or_light(ratio):
    """One wheel starts at once: the force on the other is (1 - ratio)/(1 + ratio) of what drives the first."""
    moved = abs(braked_together(np.zeros((1, 1)), np.full((1, 1), 0.3), np.full((1, 1), 0.05), 0.2, ratio, 0.04, 0.0)[0][0, 0])
    assert (moved > 1e-3) == (abs((1 - ratio) / (1 + ratio)) * 0.3 > 0.04)


@pytest.mark.slow
def test_the_second_implementation_agrees():
    values = {"tau_s": 0.15, "turn_ratio": 0.5, "friction_m_s": 0.06, "loss_m_s": 0.02}
    model = Model(wheelbase_m=0.1).with_effect("gear-friction", **values)
    left, right, duration = [[0.2, 0.0, -0.1]], [[0.05, 0.1, 0.0]], [[0.5, 0.3, 0.6]]
    heading = simulate(model, left, right, duration)[0, :, 2]
    step_s = 5e-3
    told = np.stack([np.repeat(np.array(side)[0], np.rint(np.array(duration)[0] / step_s).astype(int)) for side in (left, right)])
    moment = Moment(step_s, np.arange(told.shape[1]) * step_s, np.zeros((1, 1)), RNG)
    way = GearFriction(**values).wheels(told.T[None], moment)[0].sum(axis=0) * step_s
    assert heading[-1] == pytest.approx((way[1] - way[0]) / 0.1, abs=1e-3)
