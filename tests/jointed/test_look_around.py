"""A fit of a body looks beside where it ended: its loss has many small valleys."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.estimate.fitting import Problem, _Point
from bns.diagnose.estimate.look_around import lower_place
from bns.diagnose.estimate.parameters import FreeParameter
from bns.physics.jointed.model_files import load_body

SNAKE = load_body("snake")
NUMBER = FreeParameter("compliance", SNAKE.catalogue()["compliance"].parameters[0])


def stiff(value):
    return SNAKE.with_effect("compliance", stiffness=value)


def bumpy(model):
    """A valley at 0.7 with ripples in it."""
    off = np.log(NUMBER.of(model) / 0.7)
    return 400 + 2e3 * off**2 - 8 * np.cos(2 * np.pi * off / 0.08)


RIPPLE = float(min(np.linspace(0.735, 0.785, 501), key=lambda value: bumpy(stiff(value))))


def test_a_lower_place_beyond_a_rise_is_found():
    assert 0.74 < RIPPLE < 0.78
    found = lower_place(bumpy, stiff(RIPPLE), [NUMBER], bumpy(stiff(RIPPLE)))
    assert found is not None
    assert NUMBER.of(found) == pytest.approx(0.7, rel=0.03)
    assert lower_place(bumpy, found, [NUMBER], bumpy(found) - 1.0) is None


def test_a_fit_of_a_body_goes_on_from_a_lower_place(monkeypatch):
    problem = Problem.__new__(Problem)
    problem._trials, problem.predictor = 1, SimpleNamespace(luck=object(), tracks=SimpleNamespace(extra={}))
    problem.loss = bumpy
    problem._point = lambda model: _Point(model, np.zeros((1, 3)), bumpy(model))
    problem._jacobian = lambda *_args, **_kwargs: SimpleNamespace(jacobian=None)
    problem._descended = lambda at, free, nearby, most: (at, SimpleNamespace(jacobian=None), True)
    problem._concluded = lambda model, free, whitened, jacobian: model
    assert NUMBER.of(problem.fit(stiff(RIPPLE))) == pytest.approx(0.7, rel=0.03)
    assert NUMBER.of(problem.fit(stiff(RIPPLE), rounds=0)) == RIPPLE
    problem.predictor.luck = None
    assert NUMBER.of(problem.fit(stiff(RIPPLE))) == RIPPLE
