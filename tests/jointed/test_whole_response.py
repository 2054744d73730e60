"""The chance of a body's effect goes by its whole response: near a joint that bends no further, the slope says nothing."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.estimate.chords import chords
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem, _Point
from bns.diagnose.estimate.parameters import FreeParameter, increments
from bns.physics.effects import effect_named
from bns.physics.jointed.model_files import load_body
from bns.physics.model import load_model

GAIN = effect_named("speed-gain")
LOST_M = np.array([[1.0, 2.0, 3.0], [0.5, 0.0, -1.0]])


def saturated(model):
    """A response that ends where a gain has fallen to 0.8."""
    return LOST_M * min(1.0 - model.values_of("speed-gain")["gain"], 0.2)


@pytest.mark.parametrize(("gain", "column"), [(0.5, LOST_M * 0.2 / -0.5), (0.9, LOST_M * 0.1 / -0.1), (1.0, np.zeros((2, 3)))])
def test_a_chord_is_the_change_from_neutral_and_at_neutral_the_slope(gain, column):
    problem = Problem.__new__(Problem)
    problem.whitened = saturated
    model = load_model("khepera").with_effect("speed-gain", gain=gain)
    free = (FreeParameter("speed-gain", GAIN.parameters[0]),)
    fit = SimpleNamespace(
        model=model, free=free, values=np.array([gain]), whitened=saturated(model), jacobian=np.zeros((2, 3, 1))
    )
    np.testing.assert_allclose(chords(problem.whitened, fit, [0])[..., 0], column, atol=1e-12)


def stepped(model):
    """A response with a step within a thousandth of its value: its slope there is thirty times that of the whole."""
    gain = model.values_of("speed-gain")["gain"]
    return LOST_M * ((1.0 - gain) + 0.3 * min(max((gain - 0.8) / 0.01, 0.0), 1.0))


def test_a_wide_slope_is_that_of_the_side_where_less_changes():
    problem, number = Problem.__new__(Problem), FreeParameter("speed-gain", GAIN.parameters[0])
    problem.whitened, problem.predictor = stepped, SimpleNamespace(tracks=SimpleNamespace(extra={}), luck=object())
    model = load_model("khepera").with_effect("speed-gain", gain=0.801)
    at = _Point(model, stepped(model), 0.0)
    (narrow,) = (problem._slope(at, [number], 0, by) for by in increments(number, 0.801))
    sides = [problem._slope(at, [number], 0, by) for by in increments(number, 0.801, wide=True)]
    assert np.abs(narrow).max() > 10 * min(np.abs(side).max() for side in sides)
    wide = problem._jacobian(at, [number], wide=True).jacobian[..., 0]
    np.testing.assert_allclose(wide, min(sides, key=lambda side: (side**2).sum()))


@pytest.mark.parametrize(("value", "signs"), [(0.99, [-1]), (0.5, [1, -1]), (0.01, [1])])
def test_wide_steps_stay_within_the_bounds(value, signs):
    parameter = load_body("snake").catalogue()["weak-joint-joint5"].parameters[0]
    steps = increments(FreeParameter("weak-joint-joint5", parameter), value, wide=True)
    assert np.sign(steps).tolist() == signs
    assert all(0 <= value + step <= 1 for step in steps)


def test_an_interval_ends_at_the_bounds_of_its_number():
    parameter = load_body("snake").catalogue()["weak-joint-joint5"].parameters[0]
    fit = SimpleNamespace(
        free=(FreeParameter("weak-joint-joint5", parameter),),
        values=np.array([0.02]),
        losses=np.zeros(20),
        se=lambda _: 0.1,
        spans={},
        jacobian=np.ones((20, 3, 1)),
    )
    low, high = Fit.interval(fit, 0)
    assert low == 0.0
    assert high == pytest.approx(0.02 + 0.1 * 2.093, abs=1e-3)
