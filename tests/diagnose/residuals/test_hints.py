"""A formula that may be nothing is no hint."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from sklearn import linear_model

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals import symbolic
from bns.diagnose.residuals.symbolic import Formula, best_formula, fitted
from tests.diagnose.worlds import NOMINAL, hidden, measured


@pytest.fixture(scope="module")
def slow():
    """The problem of a robot that drives 4 % too slowly, which the model does not know, and the fit of it."""
    problem = problem_for(WheelPredictor(tracks_of(measured(hidden(speed_gain={"gain": 0.96})))), NOMINAL)
    return problem, problem.fit(NOMINAL)


def earning(formula, gain):
    return replace(formula, paired_comparison=replace(formula.paired_comparison, elpd_diff=gain))


@pytest.fixture
def chosen(slow, monkeypatch):
    """What is chosen of terms with the gains that they are said to have."""

    def best(**gains):
        formulas = {"real": "k0 * v", "nothing": "k0 * v * x * y", "both": "k0 * v + k1 * v * x * y"}
        tried = [earning(fitted(*slow, "v", formulas[name]), gain) for name, gain in gains.items()]
        monkeypatch.setattr(symbolic, "_tried", lambda *_: tried)
        return best_formula(*slow, [None])

    return best


def test_a_term_whose_numbers_may_all_be_nothing_is_no_hint_whatever_it_seems_to_earn(chosen):
    assert chosen(nothing=5.0) is None
    assert chosen(nothing=5.0, real=1.0).term == "k0 * v"


def test_a_term_of_which_one_number_is_certain_is_one(chosen):
    found = chosen(both=1.0)
    assert found.certain
    assert found.values["k0"] == pytest.approx(-0.04, abs=0.01)


def test_what_a_number_of_the_model_does_already_is_no_term(monkeypatch):
    """A gain of turns beside a wheelbase: both together may be anything."""
    true = hidden(wheelbase={"factor": 1.08}, turn_dead_zone={"width_rad_s": 0.05})
    problem = problem_for(WheelPredictor(tracks_of(measured(true))), NOMINAL)
    offered, pursuit = [], linear_model.orthogonal_mp
    monkeypatch.setattr(linear_model, "orthogonal_mp", lambda m, *a, **k: offered.append(m.shape[1]) or pursuit(m, *a, **k))
    for model, terms in ((NOMINAL, 2), (NOMINAL.with_effect("wheelbase", factor=1.08), 1)):
        found = symbolic._sparse(problem, problem.fit(model), "w", ["w", "moving * sign(w)"])
        assert set(offered) == {terms}
        offered.clear()
    assert found.term == "k0 * moving * sign(w)"


def test_what_earns_nothing_is_none(chosen):
    assert chosen(real=-1.0) is None


@pytest.mark.parametrize(
    ("of_k", "certain"), [((-0.1, 0.2), False), ((0.0, 0.2), False), ((0.1, 0.2), True), ((-0.2, -0.1), True)]
)
def test_that_a_place_is_known_makes_nothing_of_it_certain(of_k, certain):
    """Where a patch lies says nothing: its strength does, and another effect's does not."""
    spans = {("unlisted", "a"): (1.0, 1.1), ("unlisted", "k"): of_k, ("speed-gain", "k"): (0.9, 0.95)}
    free = [SimpleNamespace(effect=effect, parameter=SimpleNamespace(name=name)) for effect, name in spans]
    fit = SimpleNamespace(free=free, interval=lambda j: list(spans.values())[j])
    assert Formula("v", "k * v * exp(-(x - a)**2)", fit, None).certain == certain
