"""Numbers of a formula are of any size: what multiplies the square of 1000 s is tiny, and a time in seconds is large."""

import numpy as np
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.plausibility import believable, implausible
from bns.diagnose.estimate.problem import settled_problem
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.predict.wheels import WheelPredictor
from bns.errors import ModelError
from bns.physics.formula import formula_effect
from tests.diagnose.residuals.test_drift import MODEL, driven


@pytest.fixture(scope="module")
def problem():
    """A turn rate that is off by up to 0.04 rad/s, 1 - exp(-t/200) of it after t seconds of the session."""
    return settled_problem(WheelPredictor(tracks_of(driven(0.04, trials=20))), MODEL)[0]


@pytest.fixture(scope="module")
def exact(problem):
    return fitted(problem, "moving * a * (1 - exp(-t/200))")


def fitted(problem, term):
    return fit_with(problem, problem.fit(MODEL), formula_effect("own", term, "w"))


def values(fit):
    return fit.model.values_of("own")


@pytest.mark.parametrize(
    ("term", "expected"),
    [("moving * a * (1 - exp(-t/b))", {"a": 0.04, "b": 200.0}), ("moving * a * (1 - exp(-t*b))", {"a": 0.04, "b": 0.005})],
)
def test_a_number_that_a_term_is_not_linear_in_is_found_from_afar(problem, exact, term, expected):
    """exp(-t*b) is infinite where b is negative: such a start is none, and the term is no worse for it."""
    fit = fitted(problem, term)
    assert fit.loss <= exact.loss + 0.1
    assert values(fit) == pytest.approx(expected, rel=0.1)
    assert implausible(fit, "own") == ""
    assert believable(fit, "own") is None


def test_numbers_in_large_units_are_as_well_known_as_in_small_ones(problem):
    """With steps of 0.02 for the slope, b would turn the robot by thousands of radians each second."""
    large, small = (fitted(problem, f"moving * (a * {t} + b * {t} * {t})") for t in ("t", "(t / 1000)"))
    assert large.loss == pytest.approx(small.loss, abs=0.05)
    assert values(large)["a"] == pytest.approx(values(small)["a"] / 1e3, rel=0.01)
    assert values(large)["b"] == pytest.approx(values(small)["b"] / 1e6, rel=0.01)
    np.testing.assert_allclose(np.diag(large.covariance) * [1e6, 1e12], np.diag(small.covariance), rtol=0.05)


def test_a_formula_without_a_value_anywhere_is_refused(problem):
    with pytest.raises(ModelError, match="is nan somewhere on these trials: a pole"):
        fitted(problem, "a * log(-1 - t) + b * t**b")


@pytest.mark.parametrize(
    ("term", "neutral", "starts"),
    [
        ("k * t", {"k": 0.0}, 1),
        ("a * t + b * t * t", {"a": 0.0, "b": 0.0}, 1),
        ("a * exp(-t * b)", {"a": 0.0, "b": 1.0}, 10),
        ("b * exp(-t * a)", {"a": 1.0, "b": 0.0}, 10),
        ("a * exp(-t * c) + b * v", {"a": 0.0, "b": 0.0, "c": 1.0}, 10),
        ("a * b * v", {"a": 0.0, "b": 1.0}, 10),
        ("max(v - a, b)", {"a": 0.0, "b": 1.0}, 10),
        ("max(v - a, 0)", {"a": 0.0}, 18),
    ],
)
def test_a_term_begins_where_it_is_nothing(term, neutral, starts):
    effect = formula_effect("own", term, "v")
    assert effect.neutral == neutral
    assert len(effect.starts) == starts
    assert all(start[i] == 0.0 for start in effect.starts[:1] for i, p in enumerate(neutral) if starts < 18 and neutral[p] == 0.0)
