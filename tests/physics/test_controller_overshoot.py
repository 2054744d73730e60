"""Speed controllers that overshoot: the exact recurrence against matrix exponentials, and against a controller and its motor."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from bns.physics.model import Model
from bns.physics.wheels.differential_drive import simulate
from bns.physics.wheels.scans import first_order, second_order

RNG = np.random.default_rng(3)
STEPS = RNG.uniform(0.01, 0.3, (2, 30))
STEPS[1, 7] = 0.0
TARGETS = RNG.normal(size=(2, 30))


def by_exponentials(tau_s, lead_s, swing_s):
    """Mean of w in each step: the state is y, y', the integral of w, and the held target."""
    square = swing_s**2
    system = [[0, 1, 0, 0], [-1 / square, -(tau_s + lead_s) / square, 0, 1 / square], [1, lead_s, 0, 0], [0, 0, 0, 0]]
    mean = np.zeros_like(TARGETS)
    for row in range(2):
        state = np.zeros(2)
        for k in np.flatnonzero(STEPS[row]):
            after = expm(np.array(system) * STEPS[row, k]) @ [*state, 0.0, TARGETS[row, k]]
            state, mean[row, k] = after[:2], after[2] / STEPS[row, k]
    return mean


@pytest.mark.parametrize(
    "values",
    [(0.05, 0.0, 0.08), (0.2, 0.1, 0.05), (0.02, 0.3, 0.5), (0.1, 0.0, 0.05), (0.1, 0.0, 0.05 + 1e-7), (0.1, 0.0, 0.05 - 1e-7),
     (0.3, 0.2, 0.01), (0.0, 0.0, 0.2), (0.3, 0.1, 0.001)],
)  # fmt: skip
def test_the_recurrence_is_exact_with_and_without_a_swing_and_between_the_two(values):
    np.testing.assert_allclose(second_order(TARGETS, STEPS, *values), by_exponentials(*values), atol=1e-10)


@pytest.mark.parametrize("swing_s", [0.0, 1e-7])
def test_without_a_swing_it_is_a_lag_of_the_first_order(swing_s):
    np.testing.assert_allclose(second_order(TARGETS, STEPS, 0.3, 0.0, swing_s), first_order(TARGETS, STEPS, 0.3), atol=1e-9)
    with_lead = second_order(TARGETS, STEPS, 0.2, 0.1, swing_s)  # a part u·lead/(tau + lead) follows at once
    at_once_and_late = np.where(STEPS > 0.0, TARGETS / 3, 0.0) + first_order(TARGETS, STEPS, 0.3) * 2 / 3
    np.testing.assert_allclose(with_lead, at_once_and_late, atol=1e-9)


def test_where_all_values_are_neutral_the_command_is_what_is_driven():
    np.testing.assert_array_equal(second_order(TARGETS, STEPS, 0.0, 0.0, 0.0), np.where(STEPS > 0.0, TARGETS, 0.0))


def test_it_is_a_controller_with_two_parts_on_a_motor():
    """P = 0.6, I = 5 /s, K = 2, T = 0.09 s: tau = 1/(K·I), lead = P/I, swing² = T/(K·I); solved by scipy from the loop itself."""
    told = np.array([[0.1, -0.05, 0.12]])
    duration = np.array([[0.4, 0.3, 0.8]])
    ends = np.cumsum(duration)

    def loop(t, state):
        _, w, summed = state
        error = told[0, min(np.searchsorted(ends, t, side="right"), 2)] - w
        return [w, (2.0 * (0.6 * error + 5.0 * summed) - w) / 0.09, error]

    way = solve_ivp(loop, (0, 1.5), [0, 0, 0], max_step=1e-3, rtol=1e-9, atol=1e-12, t_eval=[0, *ends[:-1], 1.5]).y[0]
    found = second_order(told, duration, 0.1, 0.12, np.sqrt(0.09 / 10.0)) * duration
    np.testing.assert_allclose(found[0], np.diff(way), atol=1e-6)


def test_turns_swing_with_the_inertia_and_lines_with_the_mass():
    model = Model(wheelbase_m=0.1).with_effect("controller-overshoot", tau_s=0.05, lead_s=0.02, swing_s=0.2, turn_ratio=0.25)
    ahead, turned = (simulate(model, [[left]], [[0.1]], [[0.3]])[0, -1] for left in (0.1, -0.1))
    assert ahead[0] == pytest.approx(0.3 * second_order(np.array([[0.1]]), np.array([[0.3]]), 0.05, 0.02, 0.2)[0, 0])
    on_the_spot = second_order(np.array([[0.1]]), np.array([[0.3]]), 0.05, 0.02, 0.1)[0, 0]
    assert turned[2] == pytest.approx(0.3 * on_the_spot / 0.05)
