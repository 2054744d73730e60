"""Wheels that slow down, or answer, unlike each other: exact recurrences against other solutions of the same equations."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bns.physics.model import Model
from bns.physics.wheels.braking import lagging, limited
from bns.physics.wheels.differential_drive import simulate
from bns.physics.wheels.scans import first_order, rate_limited
from tests.hidden_effects.cause import Moment
from tests.hidden_effects.listed import cause

RNG = np.random.default_rng(7)
STEPS = RNG.uniform(0.02, 0.4, (2, 40))
STEPS[1, 7] = 0.0
TOLD = RNG.uniform(-0.3, 0.3, (2, 40)) * (RNG.random((2, 40)) < 0.7)


@pytest.mark.parametrize("brake_s", [0.05, 0.2, 0.5])
def test_a_lag_that_differs_for_slowing_down_is_solved_exactly(brake_s):
    """Solved by scipy: 1e-6 m of way in each step."""
    ends = np.cumsum(STEPS[0])

    def wheel(t, state):
        gap = TOLD[0, min(np.searchsorted(ends, t, side="right"), 39)] - state[1]
        return [state[1], gap / (brake_s if gap * state[1] < 0 else 0.2)]

    solved = solve_ivp(wheel, (0, ends[-1]), [0.0, 0.0], t_eval=ends, max_step=2e-3, rtol=1e-9, atol=1e-12)
    way = lagging(TOLD[:1], STEPS[:1], 0.2, brake_s)[0] * STEPS[0]
    np.testing.assert_allclose(way, np.diff(solved.y[0], prepend=0.0), atol=1e-6)


def test_alike_for_both_they_are_the_plain_lag_and_the_plain_limit():
    np.testing.assert_allclose(lagging(TOLD, STEPS, 0.2, 0.2), first_order(TOLD, STEPS, 0.2), atol=1e-15)
    np.testing.assert_allclose(limited(TOLD, STEPS, 0.5, 0.5), rate_limited(TOLD, STEPS, 0.5), atol=1e-15)


@pytest.mark.parametrize("solver", [lambda *of: lagging(*of, 0.2, 0.07), lambda *of: limited(*of, 0.4, 1.1)])
def test_steps_may_be_cut_anywhere(solver):
    cut = np.sort(np.concatenate([np.cumsum(STEPS[0]), RNG.uniform(0.0, STEPS[0].sum(), 300)]))
    steps = np.diff(cut, prepend=0.0)[None]
    of = np.minimum(np.searchsorted(np.cumsum(STEPS[0]), cut - 1e-12), 39)
    whole = np.cumsum(solver(TOLD[:1], STEPS[:1])[0] * STEPS[0])
    parts = np.cumsum(solver(TOLD[:1, of], steps)[0] * steps[0])
    np.testing.assert_allclose(parts[np.searchsorted(cut, np.cumsum(STEPS[0]) - 1e-12)], whole, atol=1e-12)


def test_a_limited_wheel_stops_after_its_speed_over_the_limit_for_braking_and_then_speeds_up_by_the_other():
    told, steps = np.array([[0.2, -0.2, 0.0]]), np.array([[2.0, 1.0, 1.0]])
    way = limited(told, steps, 0.4, 1.0)[0] * steps[0]
    assert way[0] == pytest.approx(0.2 * 2.0 - 0.2**2 / 0.4 / 2)
    stop_s = 0.2 / 1.0
    turned_s = stop_s + 0.2 / 0.4
    assert way[1] == pytest.approx(0.2 * stop_s / 2 - 0.2**2 / 0.4 / 2 - 0.2 * (1.0 - turned_s))
    assert way[2] == pytest.approx(-(0.2**2) / 1.0 / 2)


def test_no_lag_and_no_limit_change_nothing():
    np.testing.assert_allclose(lagging(TOLD, STEPS, 0.0, 0.0), np.where(STEPS > 0, TOLD, 0.0))
    plain = Model(wheelbase_m=0.2)
    for name, values in {
        "lag-mismatch": {"tau_s": 0.0, "ratio": 2.0},
        "braking-lag": {"tau_s": 0.0, "brake_ratio": 2.0},
        "braking-limit": {"max_m_s2": np.inf, "brake_ratio": 2.0},
        "braking-ramp": {"forward_m_s2": np.inf, "turn_rad_s2": np.inf, "brake_ratio": 2.0},
    }.items():
        models, commands = (plain, plain.with_effect(name, **values)), (TOLD[:, :1], TOLD[:, 1:2], STEPS[:, :1])
        driven = [simulate(model, *commands) for model in models]
        np.testing.assert_allclose(*driven, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("lag-mismatch", {"tau_s": 0.15, "ratio": 2.5}),
        ("braking-lag", {"tau_s": 0.15, "brake_ratio": 0.4}),
        ("braking-limit", {"max_m_s2": 0.3, "brake_ratio": 2.5}),
        ("braking-ramp", {"forward_m_s2": 0.3, "turn_rad_s2": 5.0, "brake_ratio": 0.4}),
    ],
)
def test_the_second_implementation_agrees(name, values):
    model = Model(wheelbase_m=0.0884).with_effect(name, **values)
    left, right, duration = np.array([[0.2, 0.0, -0.1]]), np.array([[0.05, 0.1, 0.0]]), np.array([[0.5, 0.3, 0.6]])
    heading = simulate(model, left, right, duration)[0, :, 2]
    step_s = 5e-3
    told = np.stack([np.repeat(side[0], np.rint(duration[0] / step_s).astype(int)) for side in (left, right)], axis=1)
    moment = Moment(step_s, np.arange(len(told)) * step_s, np.zeros((1, 1)), RNG)
    way = cause(name, values).wheels(told[None], moment)[0].sum(axis=0) * step_s
    assert heading[-1] == pytest.approx((way[1] - way[0]) / 0.0884, abs=1e-3)


def test_speeds_are_scaled_as_forward_velocity_and_turn_rate_are_divided_by_how_much_the_faster_wheel_exceeds_the_limit():
    told = RNG.uniform(-0.3, 0.3, (1, 40, 2))
    driven = cause("speed-scaling", {"max_m_s": 0.12}).command(told)[0]
    assert 0.2 < (driven != told[0]).any(axis=1).mean() < 1.0
    model = Model(wheelbase_m=0.0884).with_effect("speed-scaling", max_m_s=0.12)
    heading = simulate(model, told[..., 0], told[..., 1], np.full((1, 40), 0.2))[0, :, 2]
    turned = np.cumsum(driven[:, 1] - driven[:, 0]) * 0.2 / 0.0884
    np.testing.assert_allclose(heading[1:] if len(heading) == 41 else heading, turned, atol=1e-9)


def test_with_different_lags_one_step_of_speed_turns_the_robot_by_the_difference_of_the_ways():
    model = Model(wheelbase_m=0.2).with_effect("lag-mismatch", tau_s=0.15, ratio=2.0)
    heading = simulate(model, [[0.2]], [[0.2]], [[5.0]])[0, -1, 2]
    assert heading == pytest.approx(-0.2 * (0.2 - 0.1) / 0.2, abs=1e-9)
