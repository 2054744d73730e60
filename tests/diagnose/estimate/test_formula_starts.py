"""A formula that the diagnosis offers can be added in the time of one fit, however many numbers it has."""

from itertools import product

import numpy as np
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import _starts, fit_with
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.symbolic import _within
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect, Parameter
from bns.physics.formula import formula_effect
from tests.diagnose.worlds import NOMINAL, hidden, measured

SHARES = DEFAULTS.estimate.start_shares


def in_numbers(count):
    numbers = tuple(Parameter(f"x{i}", "m", -9.0, 9.0, (-1.0 - i, 2.0 + i), 0.0, "") for i in range(count))
    return Effect("mine", "mechanics", numbers, "", "", (), lambda plant, **_: plant)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_one_number_starts_on_a_grid_two_along_their_axes_and_three_where_those_cross(count):
    grids = [[share * end for end in (-1.0 - i, 2.0 + i) for share in SHARES] for i in range(count)]
    along = {tuple(x if i == axis else 0.0 for i in range(count)) for axis in range(count) for x in grids[axis]}
    cross = set(product(*grids))
    crossing = count != 2 and len(cross) <= DEFAULTS.estimate.start_most
    assert set(_starts(in_numbers(count), None, None)) == (cross if crossing else along)


@pytest.mark.parametrize(
    ("term", "linear"),
    [
        ("k0 * u + k1 * u * abs(u)", True),
        ("k0 * fresh + k1 * max(fresh, 0) + k2 * u**3", True),
        ("k * v * exp(-a * x)", False),
        ("k * max(u - a, 0)", False),
        ("k * v + 1", False),
        ("abs(k) * v", False),
        ("max(k, 0) * v", False),
        ("min(a, b) * v", False),
    ],
)
def test_a_sum_of_numbers_times_something_starts_at_nothing(term, linear):
    effect = formula_effect("mine", term, "wheels" if "u" in term else "v")
    assert (len(effect.starts) == 1) == linear
    if linear:
        assert set(effect.starts[0]) == {0.0}
        assert set(effect.neutral.values()) == {0.0}


@pytest.mark.parametrize("limit_m_s", [0.15, 0.19, 0.21])
def test_a_limit_is_found_from_starts_of_which_the_best_limits_nothing(limit_m_s):
    """Wheels share a supply: from 0.3 on it suffices for both, and 0.1 is worse than no limit at all."""
    effect = formula_effect("power", "min(1, k / (abs(l) + abs(r) + 0.0001)) - 1", "share")
    truth = NOMINAL.with_active(effect, (limit_m_s,))
    predictor = WheelPredictor(tracks_of(measured(truth, trials=12, seed=3, speeds=(-0.12, 0.12))))
    problem = problem_for(predictor, NOMINAL)
    base = problem.fit(NOMINAL)
    assert problem.loss(NOMINAL.with_active(effect, (0.1,))) > base.loss
    assert problem.loss(NOMINAL.with_active(effect, (0.3,))) == pytest.approx(base.loss, rel=1e-12)
    found = fit_with(problem, base, effect)
    assert found.values[0] == pytest.approx(limit_m_s, abs=0.003)


@pytest.mark.parametrize("per_volt", [0.004, 0.0435])
def test_the_only_number_of_a_limit_is_found_whatever_its_size(per_volt):
    """From 0.1 on the limit would be 1.2 m/s, far above all commands: there no slope leads back."""
    table = measured(hidden(speed_limit={"max_m_s": 12 * per_volt}), trials=12, seed=3, speeds=(0.0, 20 * per_volt))
    predictor = WheelPredictor(tracks_of(table.assign(battery_v=12.0)))
    effect = formula_effect("sag", "max(min(u, k*battery_v), -k*battery_v) - u", "wheels", columns=["battery_v"])
    problem = problem_for(predictor, NOMINAL)
    fit = fit_with(problem, problem.fit(NOMINAL), effect)
    assert fit.model.values_of("sag")["k"] == pytest.approx(per_volt, rel=0.02)


def test_seven_numbers_are_found_at_once():
    places = (0.02, 0.05, 0.08, 0.11, 0.14, 0.17)
    bends = [f"max(u - {c:g}, 0)" for c in places]
    term = "k0 * u + " + " + ".join(f"k{i + 1} * {b}" for i, b in enumerate(bends))
    predictor = WheelPredictor(tracks_of(measured(hidden(speed_gain={"gain": 0.9}), trials=8)))
    problem = problem_for(predictor, NOMINAL)
    effect = formula_effect("mine", term, "wheels")
    assert len(list(_starts(effect, predictor, NOMINAL))) == 1
    found = fit_with(problem, problem.fit(NOMINAL), effect).model.values_of("mine")
    u = np.linspace(0.02, 0.2, 10)
    curve = found["k0"] * u + sum(found[f"k{i + 1}"] * np.maximum(u - c, 0) for i, c in enumerate(places))
    np.testing.assert_allclose(curve, -0.1 * u, atol=0.002)


def test_many_numbers_of_another_kind_start_alike_and_the_factor_at_nothing():
    predictor = WheelPredictor(tracks_of(measured(NOMINAL, trials=2)))
    starts = list(_starts(formula_effect("mine", "k * v * exp(-a * x - b * y - c * x * y - e * x**2)", "v"), predictor, NOMINAL))
    assert len(starts) == 10
    assert all(len(set(others)) == 1 and k == 0.0 for *others, k in starts)


def test_a_number_of_a_slow_robot_may_be_large_and_a_start_beyond_all_bounds_is_drawn_in():
    """A term in v**3 of a robot of 0.01 m/s has a number near -2000; a step of least squares may lead anywhere."""
    effect = formula_effect("cubic", "k * v**3", "v")
    assert effect.checked({"k": -1800.0}) == (-1800.0,)
    low, high = effect.parameters[0].low, effect.parameters[0].high
    assert [_within(effect, {"k": k}) for k in (-1e12, 3.5, 1e12)] == [(low,), (3.5,), (high,)]
    assert _within(effect, {}) == (0.0,)
