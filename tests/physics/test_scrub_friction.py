"""Friction against turns beside a lag: the exact recurrence against a general solver, and what can be worked out by hand."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bns.physics.effects import effect_named
from bns.physics.model import Model
from bns.physics.signals import Wheels
from bns.physics.wheels.differential_drive import simulate
from bns.physics.wheels.friction import braked
from bns.physics.wheels.scans import first_order
from tests.hidden_effects.cause import Body, Moment
from tests.hidden_effects.listed_loads import ScrubFriction

RNG = np.random.default_rng(8)
STEPS = RNG.uniform(0.02, 0.4, (2, 40))
STEPS[1, 7] = 0.0
TOLD = RNG.uniform(-0.3, 0.3, (2, 40)) * (RNG.random((2, 40)) < 0.7)


@pytest.mark.parametrize(("tau_s", "friction"), [(0.15, 0.05), (0.15, 0.2), (0.02, 0.1)])
def test_it_is_a_lag_with_dry_friction(tau_s, friction):
    """Solved by scipy, with friction as a steep slope near rest: 0.02 mm of way in each step."""
    ends = np.cumsum(STEPS[0])

    def slope(t, state):
        told = TOLD[0, min(np.searchsorted(ends, t, side="right"), 39)]
        return [state[1], (told - state[1] - friction * np.tanh(state[1] / 1e-5)) / tau_s]

    def steepness(_t, state):
        return [[0.0, 1.0], [0.0, -(1 + friction / 1e-5 / np.cosh(min(abs(state[1]) / 1e-5, 300.0)) ** 2) / tau_s]]

    how = {"method": "Radau", "jac": steepness, "max_step": 5e-3, "rtol": 1e-7, "atol": 1e-9, "t_eval": ends}
    solved = solve_ivp(slope, (0, ends[-1]), [0.0, 0.0], **how)
    np.testing.assert_allclose(braked(TOLD, STEPS, tau_s, friction)[0] * STEPS[0], np.diff(solved.y[0], prepend=0.0), atol=2e-5)


def test_without_friction_it_is_a_lag_and_without_a_lag_a_dead_zone():
    np.testing.assert_allclose(braked(TOLD, STEPS, 0.2, 0.0), first_order(TOLD, STEPS, 0.2), atol=1e-14)
    rest = np.where(STEPS > 0.0, np.sign(TOLD) * np.maximum(np.abs(TOLD) - 0.1, 0.0), 0.0)
    for tau_s in (0.0, 1e-12):
        np.testing.assert_allclose(braked(TOLD, STEPS, tau_s, 0.1), rest, atol=1e-9)


def test_steps_may_be_cut_anywhere():
    cut = np.sort(np.concatenate([np.cumsum(STEPS[0]), RNG.uniform(0.0, STEPS[0].sum(), 300)]))
    steps = np.diff(cut, prepend=0.0)[None]
    of = np.minimum(np.searchsorted(np.cumsum(STEPS[0]), cut - 1e-12), 39)
    whole = np.cumsum(braked(TOLD[:1], STEPS[:1], 0.15, 0.1) * STEPS[:1], axis=1)[0]
    parts = np.cumsum(braked(TOLD[:1, of], steps, 0.15, 0.1) * steps, axis=1)[0]
    np.testing.assert_allclose(parts[np.searchsorted(cut, np.cumsum(STEPS[0]) - 1e-12)], whole, atol=1e-12)


def test_a_turn_coasts_for_the_lag_times_the_logarithm_and_then_stands():
    told, steps = np.array([[0.25, 0.0, 0.0, 0.04, -0.25]]), np.array([[3.0, 1.0, 1.0, 1.0, 3.0]])
    way = braked(told, steps, 0.1, 0.05)[0] * steps[0]
    assert way[0] == pytest.approx((0.25 - 0.05) * (3.0 - 0.1), abs=1e-9)
    assert way[1] == pytest.approx(0.1 * 0.2 - 0.05 * 0.1 * np.log(1 + 0.2 / 0.05))
    assert (way[2], way[3]) == (0.0, 0.0)  # friction holds what is told less
    assert way[4] == pytest.approx(-(0.25 - 0.05) * (3.0 - 0.1), abs=1e-9)


def test_straight_lines_lag_by_themselves_and_turns_lose_a_turn_rate():
    steps, base = np.full((1, 200), 0.05), 0.4
    left, right = np.full((1, 200), 0.1), np.full((1, 200), 0.3)
    values = {"tau_s": 0.2, "turn_ratio": 0.5, "width_rad_s": 0.15}
    driven = effect_named("scrub-friction").apply(Wheels(steps, left, right, base), **values)
    way, turn = (driven.left_m_s + driven.right_m_s) / 2, (driven.right_m_s - driven.left_m_s) / base
    assert (way * steps).sum() == pytest.approx(0.2 * (10.0 - 0.2))
    assert (turn * steps).sum() == pytest.approx((0.5 - 0.15) * (10.0 - 0.1))
    np.testing.assert_allclose(driven.followed, first_order(np.ones((1, 200)), steps, 0.2))
    without = effect_named("inertia-lag").apply(Wheels(steps, left, right, base), tau_s=0.2, turn_ratio=0.5)
    still = effect_named("scrub-friction").apply(Wheels(steps, left, right, base), **(values | {"width_rad_s": 0.0}))
    np.testing.assert_allclose(still.left_m_s, without.left_m_s, atol=1e-14)


def test_the_second_implementation_agrees():
    values = {"tau_s": 0.15, "turn_ratio": 0.5, "width_rad_s": 0.3}
    model = Model(wheelbase_m=0.1).with_effect("scrub-friction", **values)
    left, right, duration = [[0.2, 0.0, -0.1]], [[0.05, 0.02, 0.0]], [[0.5, 0.3, 0.6]]
    heading = simulate(model, left, right, duration)[0, :, 2]
    step_s = 1e-3
    told = np.stack([np.repeat(np.array(side)[0], np.rint(np.array(duration)[0] / step_s).astype(int)) for side in (left, right)])
    still = np.zeros((1, told.shape[1]))
    moment = Moment(step_s, np.arange(told.shape[1]) * step_s, np.zeros((1, 1)), RNG)
    body = Body(told.mean(axis=0)[None], (told[1] - told[0])[None] / 0.1, still, still, still, still)
    turn = ScrubFriction(**values).body(body, moment).turn.sum() * step_s
    assert heading[-1] == pytest.approx(turn, abs=1e-3)
