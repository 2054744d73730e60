"""A fit without one of its effects, where another term does the same with the opposite sign."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate import lacking as lacking_module
from bns.diagnose.estimate.lacking import fit_without
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.physics.formula import formula_effect
from tests.diagnose.worlds import NOMINAL, hidden, measured


@cache
def predictor():
    return WheelPredictor(tracks_of(measured(hidden(speed_gain={"gain": 1.01}), trials=12, jitter=0.001)))


@cache
def shared(gain):
    """A gain of 1.01 in two parts: too much of it by the effect, and the rest taken back by a term.

    The term's number is taken with steps of one size, which mislead far from where it is best.
    """
    free = formula_effect("term", "k0", "share")
    term = replace(free, parameters=tuple(replace(p, of_any_size=False) for p in free.parameters))
    model = NOMINAL.with_effect("speed-gain", gain=gain).with_active(term, (1.01 / gain - 1.0,))
    problem = problem_for(predictor(), model)
    return problem, problem.fit(model, 0)


@pytest.mark.parametrize("gain", [1.2, 1.6])
def test_what_is_left_takes_over_where_a_fit_from_its_own_values_is_lost(gain, monkeypatch):
    """From where the curvature leads, or, if that is too far, under more noise."""
    problem, fit = shared(gain)
    lost = problem.fit(fit.model.without("speed-gain"), nearby=fit.jacobian_by_parameter)
    assert lost.loss > 10.0 * fit.loss
    lacking = fit_without(problem, fit, "speed-gain")
    assert lacking.loss == pytest.approx(fit.loss, rel=0.01)
    assert lacking.values == pytest.approx([0.01], abs=1e-3)
    monkeypatch.setattr(lacking_module, "LOST", np.inf)
    assert (fit_without(problem, fit, "speed-gain").loss > 10.0 * fit.loss) == (gain == 1.6)


def test_an_effect_takes_over_from_a_term():
    assert fit_without(*shared(1.2), "term").values == pytest.approx([1.01], abs=1e-3)


def test_the_last_effect_leaves_the_model_as_given():
    problem, _ = shared(1.2)
    alone = problem.fit(NOMINAL.with_effect("speed-gain", gain=1.01))
    lacking = fit_without(problem, alone, "speed-gain")
    assert lacking.free == ()
    assert lacking.model == NOMINAL.arranged()


def test_of_a_limit_that_nothing_reaches_there_is_no_way_to_neutral():
    """It is infinite: the others keep their values, and are fitted."""
    problem, _ = shared(1.2)
    both = problem.fit(NOMINAL.with_effect("speed-gain", gain=1.01).with_effect("speed-limit", max_m_s=0.2))
    lacking = fit_without(problem, both, "speed-limit")
    assert lacking.values == pytest.approx([1.01], abs=1e-3)
