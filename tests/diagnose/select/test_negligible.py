"""Effects that are certain and matter to no prediction are said, and not named."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose import beside_terms, caveats, diagnosing, effect_caveats, outcome, standing
from bns.diagnose.caveats import notes_on
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.fit_set import fit_set
from bns.diagnose.estimate.parameters import FreeParameter
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import listed
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals import unexplained as rest_module
from bns.diagnose.residuals.established import Established
from bns.diagnose.residuals.grammar import CHANGES
from bns.diagnose.residuals.symbolic import fitted
from bns.diagnose.residuals.unexplained import NOTHING
from bns.diagnose.select import negligible as negligible_module
from bns.diagnose.select import result
from bns.diagnose.select.negligible import (
    LEAST_SHIFT,
    LUCK,
    MEDIAN_OF,
    Shift,
    _largest_fall,
    fall_matters,
    negligible,
    negligible_and_errors,
    seen_in_heading,
    shifted,
)
from bns.diagnose.select.result import SelectionResult, certainly_lower
from bns.diagnose.values import numbers_of
from bns.physics.effects import effect_named
from tests.diagnose.worlds import NOMINAL, all_but_rivals_of, hidden, measured

TRUTH = {"wheelbase": {"factor": 1.05}, "wheel_mismatch": {"ratio": 1.004}, "clock_offset": {"offset_s": -5e-4}}

RISING = SimpleNamespace(falls_in_the_end=False)
"""Errors with terms that are said to rise; what stands is decided elsewhere."""


@cache
def predictor():
    table = measured(hidden(**TRUTH), trials=20, seed=7, noise=(1e-3, 4e-3), jitter=0.0)
    return WheelPredictor(tracks_of(table))


@cache
def selected(*names):
    """A search that ended in these effects, by whatever steps."""
    catalogue = listed(NOMINAL, None, predictor().tracks)
    problem, fit, _ = fit_set(predictor(), NOMINAL, [catalogue[name] for name in names])
    return SelectionResult(problem, problem.fit(NOMINAL), fit, names, ())


@pytest.mark.slow
def test_half_a_millisecond_is_negligible_and_a_small_mismatch_is_not():
    assert negligible(selected("wheelbase", "wheel-mismatch", "clock-offset")) == ("clock-offset",)
    assert negligible(selected("wheelbase", "wheel-mismatch")) == ()
    assert negligible(selected("clock-offset")) == ("clock-offset",)
    assert negligible(selected("wheelbase")) == ()


def test_of_two_effects_that_can_stand_for_one_another_one_is_kept():
    """Each alone changes no error while the other is there: a clock and a command that are late are the same in a log."""
    seen = WheelPredictor(tracks_of(measured(hidden(wheelbase={"factor": 1.05}, clock_offset={"offset_s": 0.08}), trials=12)))
    names = ("wheelbase", "clock-offset", "command-delay")
    problem, fit, _ = fit_set(seen, NOMINAL, [listed(NOMINAL, None, seen.tracks)[name] for name in names])
    dropped = negligible(SelectionResult(problem, problem.fit(NOMINAL), fit, names, ()))
    assert dropped in {("clock-offset",), ("command-delay",)}


def test_ties_keep_what_is_left_of_them():
    one = selected("wheelbase", "clock-offset")
    competing = (("marker-offset", "clock-offset"), ("wheelbase", "command-delay"))
    kept = SelectionResult(one.problem, one.nominal, one.fit, one.accepted, (), competing).lacking(("clock-offset",))
    assert kept.accepted == ("wheelbase",)
    assert kept.competing_models == (("marker-offset",),)
    assert [a.effect.name for a in kept.fit.model.effects] == ["wheelbase"]
    two = selected("wheelbase", "wheel-mismatch", "clock-offset")
    competing = (("marker-offset", "wheel-mismatch", "clock-offset"), ("wheelbase", "wheel-mismatch", "command-delay"))
    kept = replace(two, competing_models=competing).lacking(("wheel-mismatch", "clock-offset"))
    assert (kept.accepted, kept.competing_models) == (("wheelbase",), (("marker-offset",),))


@pytest.mark.parametrize(
    ("truth", "rival", "stays"),
    [
        ({"wheel_mismatch": {"ratio": 1.03}}, ("clock-offset",), False),
        ({"command_delay": {"delay_s": 0.1}}, ("clock-offset",), True),
    ],
)
def test_an_explanation_that_predicts_worse_in_metres_is_no_tie(truth, rival, stays):
    seen = WheelPredictor(tracks_of(measured(hidden(**truth), trials=16, seed=5)))
    name = next(iter(truth)).replace("_", "-")
    problem, fit, _ = fit_set(seen, NOMINAL, [listed(NOMINAL, None, seen.tracks)[name]])
    one = SelectionResult(problem, problem.fit(NOMINAL), fit, (name,), (), (rival,))
    assert outcome.alike_in_metres(one).competing_models == ((rival,) if stays else ())


@pytest.mark.slow
def test_a_diagnosis_says_what_is_negligible(monkeypatch):
    """A stand-in for the judgement: the mismatch is worth naming, and is taken for negligible here."""
    asked = []

    def judged(selection):
        asked.append(selection.accepted)
        return ("wheel-mismatch",), None, {}

    beside = []
    monkeypatch.setattr(outcome, "negligible_and_errors", judged)
    monkeypatch.setattr(caveats, "on_moved", lambda found: beside.append(found.beside_negligible) or [])
    found = diagnose(predictor(), NOMINAL, barred=all_but_rivals_of("wheel-mismatch"))
    assert set(beside[0]) == set(found.effects)
    assert beside[0]["wheelbase"]["factor"]["value"] == pytest.approx(1.05, abs=5e-3)
    assert set(asked[0]) >= {"wheelbase", "wheel-mismatch"}
    assert found.verdict in {"effects", "tie"}
    assert set(found.effects) == set(asked[0]) - {"wheel-mismatch"}
    assert found.as_json()["negligible"]["wheel-mismatch"]["ratio"]["value"] == pytest.approx(1.004, abs=2e-3)
    assert any("wheel-mismatch is certain but negligible (ratio = 1" in note for note in found.notes)
    assert {a.effect.name for a in found.model.effects} == set(found.effects)


@pytest.mark.parametrize("slightly", [True, False])
def test_what_is_left_is_no_sign_of_an_effect_however_slight_it_is(monkeypatch, slightly):
    """A ridge that moves the robot by less than the tracker's noise makes many effects nearly certain."""
    given = []
    monkeypatch.setattr(outcome.Outcome, "slightly_left", slightly)
    monkeypatch.setattr(diagnosing, "_hint", lambda *all_of: given.append(all_of[3]))
    table = measured(NOMINAL, trials=16, seed=3)
    diagnose(WheelPredictor(tracks_of(table)), NOMINAL, barred=all_but_rivals_of("wheelbase"))
    assert given == [slightly]


@pytest.mark.parametrize(("matters", "named"), [(True, ("wheelbase",)), (False, ("wheelbase", "wheel-mismatch"))])
def test_effects_give_way_only_to_terms_that_matter(monkeypatch, matters, named):
    """The search with flexible terms and its judgement are mocked: the search keeps one effect beside a term."""
    searched = selected("wheelbase", "wheel-mismatch")
    found = Established(("wheelbase",), ("a term",), searched.problem, searched.fit)
    monkeypatch.setattr(outcome, "sought_terms", lambda *_: found)
    monkeypatch.setattr(beside_terms, "_errors_with_terms", lambda *_: RISING)
    monkeypatch.setattr(outcome, "without_absurd", lambda found, *_: found)
    monkeypatch.setattr(outcome, "terms_matter", lambda _: matters)
    for module in (standing, beside_terms):
        monkeypatch.setattr(module, "unexplained", lambda *_: NOTHING)
    ended = outcome.outcome_of(searched, predictor(), NOMINAL, lambda _: None)
    assert ended.selection.accepted == named
    assert ended.imitating == (("wheel-mismatch",) if matters else ())
    assert (ended.terms, ended.errors_with_terms) == ((("a term",), RISING) if matters else ((), None))


@pytest.mark.parametrize("matters", [True, False])
def test_what_terms_describe_wholly_counts_only_if_it_matters(monkeypatch, matters):
    """With mocked parts: the effect leaves something, a term leaves nothing, and the term lowers an error or does not."""
    searched = selected("wheelbase")
    found = Established(("wheelbase",), ("a term",), searched.problem, "fit with the term")
    left = replace(NOTHING, residual_dependence=("something",))
    monkeypatch.setattr(outcome, "sought_terms", lambda *_: found)
    monkeypatch.setattr(beside_terms, "_errors_with_terms", lambda *_: RISING)
    monkeypatch.setattr(outcome, "without_absurd", lambda found, *_: found)
    monkeypatch.setattr(outcome, "terms_matter", lambda _: matters)
    for module in (standing, beside_terms):
        monkeypatch.setattr(module, "residual_dependence", lambda *_: [])
        monkeypatch.setattr(module, "unexplained", lambda _, fit, *__: NOTHING if fit == found.fit else left)
    monkeypatch.setattr(outcome, "best_formula", lambda *_: None)
    ended = outcome.outcome_of(searched, predictor(), NOMINAL, lambda _: None)
    assert ended.selection.accepted == ("wheelbase",)
    assert (ended.terms, ended.slight) == ((("a term",), ()) if matters else ((), ("a term",)))
    assert ended.rest == (left if matters else NOTHING)
    assert ended.slightly_left is not matters
    if not matters:
        said = notes_on(replace(ended, terms=()), predictor().tracks, None, slight=["slower for two seconds"])
        assert next(said).startswith("What is left is certain but slight: slower for two seconds.")


@pytest.mark.parametrize(("rises", "stay"), [((), "b"), (("trial",), "ab")])
def test_moments_that_a_term_describes_are_none_unless_it_is_rejected(monkeypatch, rises, stay):
    """With mocked parts: two trials have moments beside the effect; beside the term one of them has, and one that had none."""
    searched = selected("wheelbase")
    found = Established(("wheelbase",), ("a term",), searched.problem, "fit with the term")
    moments = {name: SimpleNamespace(trial=name) for name in "abc"}
    left = replace(NOTHING, outliers=(moments["a"], moments["b"]), shared="what they share")
    monkeypatch.setattr(outcome, "sought_terms", lambda *_: found)
    monkeypatch.setattr(beside_terms, "_errors_with_terms", lambda *_: SimpleNamespace(falls_in_the_end=not rises))
    monkeypatch.setattr(outcome, "without_absurd", lambda found, *_: found)
    monkeypatch.setattr(outcome, "terms_matter", lambda _: True)
    for module in (standing, beside_terms):
        monkeypatch.setattr(module, "unexplained", lambda *_: left)
    monkeypatch.setattr(rest_module, "judged_windows", lambda _, fit: fit)
    monkeypatch.setattr(rest_module, "shared_cause", lambda *_: "what is left of it")
    monkeypatch.setattr(rest_module, "shared_place", lambda *_: "where it is left")
    monkeypatch.setattr(rest_module, "outliers", lambda _, fit, windows: [moments["b"], moments["c"]] if fit == windows else [])
    ended = outcome.outcome_of(searched, predictor(), NOMINAL, lambda _: None)
    assert [one.trial for one in ended.rest.outliers] == list(stay)
    assert ended.rest.shared == ("what they share" if rises else "what is left of it")
    assert ended.rest.place == (None if rises else "where it is left")


@pytest.mark.parametrize("better", [True, False])
def test_what_is_below_the_noise_counts_where_a_curve_does_better_than_the_effects_that_imitate_it(monkeypatch, better):
    """With mocked parts: two effects leave something that is slight; a term that has none of them beside it leaves nothing."""
    searched = selected("wheelbase", "wheel-mismatch")
    found = Established((), ("a term",), searched.problem, "fit with the term")
    left = replace(NOTHING, residual_dependence=("something",))
    asked = []
    monkeypatch.setattr(outcome, "sought_terms", lambda *_: found)
    monkeypatch.setattr(beside_terms, "_errors_with_terms", lambda *_: RISING)
    monkeypatch.setattr(outcome, "without_absurd", lambda found, *_: found)
    monkeypatch.setattr(outcome, "terms_matter", lambda _: True)
    monkeypatch.setattr(outcome, "_within_noise", lambda _: True)
    monkeypatch.setattr(outcome, "does_better_than_more", lambda *given: asked.append(given[2]) or better)
    for module in (standing, beside_terms):
        monkeypatch.setattr(module, "residual_dependence", lambda *_: [])
        monkeypatch.setattr(module, "unexplained", lambda _, fit, *__: NOTHING if fit == found.fit else left)
    monkeypatch.setattr(outcome, "best_formula", lambda *_: None)
    ended = outcome.outcome_of(searched, predictor(), NOMINAL, lambda _: None)
    assert asked == [("wheelbase", "wheel-mismatch")]
    assert (ended.selection.accepted, ended.terms) == (((), ("a term",)) if better else (searched.accepted, ()))
    assert ended.slight == (() if better else ("a term",))
    assert (ended.rest == NOTHING) is not better


def test_beside_terms_an_effect_at_its_bound_is_left_out_and_the_terms_are_searched_again(monkeypatch):
    """Terms and a wheelbase that run away from each other serve together, and neither says anything."""
    searched = selected("wheelbase", "wheel-mismatch")
    numbers = [(number.parameter, number.effect) for number in searched.fit.free]
    term = SimpleNamespace(signal="place")
    at_bound = np.array([p.high if effect == "wheelbase" else p.neutral for p, effect in numbers])
    first = Established(("wheelbase", "wheel-mismatch"), (term,), searched.problem, replace(searched.fit, values=at_bound))
    second = Established(("wheel-mismatch",), (term,), searched.problem, searched.fit)
    asked = []
    again = lambda selection, *given: (asked.append((selection.accepted, given[-1])), second)[1]  # noqa: E731
    monkeypatch.setattr(beside_terms, "sought_terms", again)
    monkeypatch.setattr(beside_terms, "_without_negligible", lambda found, *_: found)
    stands = SimpleNamespace(selection=searched, rest=NOTHING)
    assert beside_terms.without_absurd(first, stands, predictor(), None) is second
    assert asked == [(("wheel-mismatch",), {"wheelbase"})]
    assert beside_terms.without_absurd(second, stands, predictor(), None) is second


@pytest.mark.parametrize(
    ("name", "signal", "factor", "gone"),
    [
        ("clock-offset", CHANGES, 4.0, True),
        ("clock-offset", CHANGES, 1.5, False),
        ("clock-offset", "place", 4.0, False),
        ("wheelbase", CHANGES, 4.0, False),
    ],
)
def test_a_shift_in_time_that_an_answer_to_past_commands_multiplies_is_a_part_of_that_answer(name, signal, factor, gone):
    """Nothing tells when such an answer begins from when the command comes; other numbers are told as they are."""
    searched = selected("wheelbase", "clock-offset")
    at = next(i for i, number in enumerate(searched.fit.free) if number.effect == name)
    neutral = searched.fit.free[at].parameter.neutral
    without, beside = (searched.fit.values.copy() for _ in range(2))
    without[at], beside[at] = neutral + 1e-3, neutral + factor * 1e-3
    spread = np.zeros_like(searched.fit.covariance)
    spread[at, at] = 1e-10
    narrow = replace(searched.fit, covariance=spread, spans={})
    term = SimpleNamespace(signal=signal)
    found = Established(searched.accepted, (term,), searched.problem, replace(narrow, values=beside))
    assert (name in beside_terms._absurd(found, replace(narrow, values=without))) is gone



def test_with_a_term_in_the_model_an_effect_that_lowers_no_error_is_not_named():
    """A clock that is right, beside a wheelbase that is wrong and a curve; without a curve the search has judged it already."""
    seen = WheelPredictor(tracks_of(measured(hidden(wheelbase={"factor": 1.05}), trials=12)))
    model = NOMINAL.with_effect("wheelbase", factor=1.05).with_effect("clock-offset", offset_s=0.0)
    problem = problem_for(seen, model)
    fit = problem.fit(model)
    term = fitted(problem, fit, "v", "k * v * abs(v)", "unlisted", "speed and turn")
    names = ("wheelbase", "clock-offset")
    searched = SelectionResult(problem, problem.fit(NOMINAL), fit, names, ())
    found = beside_terms._without_negligible(Established(names, (term,), problem, term.fit), searched, seen)
    assert found.names == ("wheelbase",)
    assert {active.effect.name for active in found.fit.model.effects} == {"wheelbase", "unlisted"}
    assert found.terms[0].fit is found.fit
    alone = Established(names, (), problem, fit)
    assert beside_terms._without_negligible(alone, searched, seen) is alone


@pytest.mark.parametrize(("tiny", "kept"), [((), (1, 2)), (("unlisted-2",), (1,)), (("unlisted", "unlisted-2"), (1, 2))])
def test_of_several_terms_those_that_lower_no_error_go_but_never_all(monkeypatch, tiny, kept):
    """Which are negligible is mocked."""
    seen = WheelPredictor(tracks_of(measured(hidden(), trials=12)))
    problem = problem_for(seen, NOMINAL)
    one = fitted(problem, problem.fit(NOMINAL), "v", "k * v * abs(v)", "unlisted", "speed and turn")
    two = fitted(problem, one.fit, "w", "k * w * abs(w)", "unlisted-2", "speed and turn")
    found = Established((), (replace(one, fit=two.fit), two), problem, two.fit)
    asked = []
    mocked = lambda selection: asked.append(set(selection.accepted)) or (tiny, None, {})  # noqa: E731
    monkeypatch.setattr(beside_terms, "negligible_and_errors", mocked)
    ended = beside_terms._without_negligible(found, SelectionResult(problem, one.fit, one.fit, (), ()), seen)
    assert asked == [{"unlisted", "unlisted-2"}]
    names = [("unlisted", "unlisted-2")[i - 1] for i in kept]
    assert [term.name for term in ended.terms] == names
    assert all(term.fit is ended.fit for term in ended.terms)
    assert {active.effect.name for active in ended.fit.model.effects} == set(names)


@pytest.mark.parametrize(
    ("error_m", "outliers", "counts"), [(0.0013, (), False), (0.0015, (), True), (0.0013, ("a moment",), True)]
)
def test_what_adds_less_than_tracking_noise_does_not_count(monkeypatch, error_m, outliers, counts):
    """With mocked parts: the effect leaves something that no term describes; the errors are given, the noise is 1 mm."""
    searched = selected("wheelbase")
    left = replace(NOTHING, residual_dependence=("something",), outliers=outliers)
    at = SimpleNamespace(models=[SimpleNamespace(rms_m=1.0), SimpleNamespace(rms_m=error_m)], noise_floor_m=0.001, windows=1)
    monkeypatch.setattr(standing, "errors_before_and_after", lambda *_: SimpleNamespace(falls=True, horizons={1.0: at}))
    monkeypatch.setattr(outcome, "sought_terms", lambda *_: None)
    for module in (standing, beside_terms):
        monkeypatch.setattr(module, "residual_dependence", lambda *_: [])
        monkeypatch.setattr(module, "unexplained", lambda *_: left)
    monkeypatch.setattr(outcome, "best_formula", lambda *_: None)
    ended = outcome.outcome_of(searched, predictor(), NOMINAL, lambda _: None)
    assert ended.unseen is not counts
    assert ended.rest == (left if counts else NOTHING)
    if not counts:
        said = next(notes_on(ended, predictor().tracks, None))
        assert said.startswith("What is left is certain but slight: at every horizon it adds less to the error than the noise")


@pytest.mark.slow
def test_of_several_effects_only_those_that_raise_the_error_are_withdrawn(monkeypatch):
    """A stand-in for the errors: with the mismatch they rise, and fall with the wheelbase alone."""
    searched = selected("wheelbase", "wheel-mismatch", "clock-offset")

    def judged(selection, _):
        ratio = 0.5 + 0.6 * ("wheel-mismatch" in selection.accepted) - 0.1 * len(selection.accepted)
        at = SimpleNamespace(windows=0, models=[SimpleNamespace(rms_m=1.0), SimpleNamespace(rms_m=ratio)])
        return SimpleNamespace(falls=ratio < 0.5, horizons={1.0: at})

    monkeypatch.setattr(standing, "errors_before_and_after", judged)
    stands = standing.standing_of(searched, predictor(), NOMINAL, lambda _: None)
    assert stands.selection.accepted == ("wheelbase", "clock-offset")
    assert stands.withdrawn == ("wheel-mismatch",)


def errors(windows, **models):
    """Errors of models at one horizon: position, heading, median."""
    found = {name: {1.0: SimpleNamespace(rms_m=a, heading_rad=b, median_m=c)} for name, (a, b, c) in models.items()}
    return SimpleNamespace(of=found.get, horizons={1.0: SimpleNamespace(windows=windows)})


def test_an_error_falls_by_the_share_beyond_luck_of_the_measure_that_falls_most():
    few, many = MEDIAN_OF - 1, MEDIAN_OF
    models = {"before": (0.5, 0.25, 0.5), "after": (0.375, 0.125, 0.125)}
    assert _largest_fall(errors(few, **models), "before", "after") == pytest.approx(0.5 - LUCK / few**0.5)
    assert _largest_fall(errors(many, **models), "before", "after") == pytest.approx(0.75 - LUCK / many**0.5)
    nothing = {"before": (0.0, 0.0, 0.0), "after": (1.0, 1.0, 1.0)}
    assert _largest_fall(errors(many, **nothing), "before", "after") == 0.0


@pytest.mark.parametrize(
    ("without", "seen"),
    [((0.1, 0.25, 0.1), True), ((0.2, 0.25, 0.1), False), ((0.1, 0.25, 0.2), False), ((0.1, 0.1, 0.1), False)],
)
def test_an_effect_that_only_the_error_of_the_heading_shows_is_said(without, seen):
    """Errors of position, of the heading, and the median; the horizon has a name of the tool."""
    judged = errors(MEDIAN_OF, one=without, all=(0.1, 0.1, 0.1))
    (horizon,) = judged.horizons
    found = seen_in_heading(judged, ["one"])
    assert found == ({"one": (horizon, 0.25, 0.1)} if seen else {})
    assert seen_in_heading(None, ["one"]) == {}
    exact = {name: {**judged.of(name), 2.0: SimpleNamespace(rms_m=0.0, heading_rad=0.0, median_m=0.0)} for name in ("one", "all")}
    two = SimpleNamespace(of=exact.get, horizons=dict.fromkeys((horizon, 2.0), judged.horizons[horizon]))
    assert seen_in_heading(two, ["one"]) == found  # no heading is off where no pose is
    near = list(effect_caveats.on_heading({"lag": ("command", 0.01149, 0.01102)}))
    assert "from 11.5 to 11 mrad" in near[0]  # two digits would say from 11 to 11
    words = list(effect_caveats.on_heading({name: ("trial", *two) for name, (_, *two) in found.items()}))
    assert words == ["one lowers the error of the heading (over the whole trial from 250 to 100 mrad), and no error of "
                     "position by 2% or more."] * seen  # fmt: skip


@pytest.mark.parametrize(
    ("change_m", "fell", "matters"),
    [(-0.003, True, True), (-0.002, True, True), (-0.0019, True, False), (-0.003, False, False), (0.003, True, False)],
)
def test_a_fall_matters_where_it_is_certain_and_two_percent(change_m, fell, matters):
    models = (SimpleNamespace(name="a", rms_m=0.1), SimpleNamespace(name="b", rms_m=0.1 + change_m))
    nothing = SimpleNamespace(change_m=0.0, fell=False)
    change = SimpleNamespace(change_m=change_m, fell=fell)
    far = SimpleNamespace(models=models, change_between=lambda *names: {("a", "b"): change}[names])
    near = SimpleNamespace(models=models, change_between=lambda *_: nothing)
    assert fall_matters(SimpleNamespace(horizons={"1s": near, "trial": far}), "a", "b") is matters
    assert not fall_matters(SimpleNamespace(horizons={"1s": near}), "a", "b")


def test_numbers_that_what_is_negligible_moves_are_said():
    """A slope that also acts at rest is fitted 12 % too large without that; a number inside either interval has not moved."""

    def fit_of(value):
        slope = effect_named("floor-slope")
        free = [SimpleNamespace(effect="floor-slope", parameter=p) for p in slope.parameters]
        ends = [(value - 1e-4, value + 1e-4), (0.001, 0.005)]
        return SimpleNamespace(
            free=free,
            values=np.array([value, 0.003]),
            interval=lambda i: ends[i],
            se=lambda _: 1e-4,
            model=SimpleNamespace(per_trial_effect=None),
        )

    def notes(now, beside):
        numbers = numbers_of(fit_of(beside))
        found = SimpleNamespace(
            selection=SimpleNamespace(fit=fit_of(now)), beside_negligible=numbers, negligible={"slope-load": {}}
        )
        return list(effect_caveats.on_moved(found))

    said = "With slope-load in the model, the parameters of floor-slope differ: x_m_s = 0.004 m/s, not 0.0045."
    assert notes(0.0045, 0.004) == [said]
    assert notes(0.00405, 0.004) == []


@pytest.mark.parametrize(("fall", "dropped"), [(0.0199, ("b",)), (0.02, ())])
def test_an_effect_is_negligible_that_lowers_no_error_by_two_percent(monkeypatch, fall, dropped):
    monkeypatch.setattr(negligible_module, "_without_each", lambda *_: dict.fromkeys(("all", "a", "b", "c")))
    monkeypatch.setattr(negligible_module, "_errors_of", lambda *_: None)
    monkeypatch.setattr(negligible_module, "shifted", lambda *_: ())
    monkeypatch.setattr(negligible_module, "_largest_fall", lambda _errors, name, _all: {"a": 0.5, "b": fall, "c": 0.3}[name])
    assert negligible(SimpleNamespace(accepted=("a", "b", "c"), problem=None)) == dropped


@pytest.mark.parametrize(
    ("falls", "fell", "lower"),
    [(True, (None, True), True), (True, (False, True), True), (True, (None, False), False), (False, (True, True), False)],
)
def test_an_error_is_certainly_lower_that_falls_over_one_horizon_and_rises_over_none(monkeypatch, falls, fell, lower):
    horizons = {at: SimpleNamespace(total=None if one is None else SimpleNamespace(fell=one)) for at, one in enumerate(fell)}
    seen = []

    def errors(predictor, steps):
        seen.append((predictor, steps))
        return SimpleNamespace(falls=falls, horizons=horizons)

    monkeypatch.setattr(result, "paired_errors", errors)
    monkeypatch.setattr(result, "held_out_steps", lambda _predictor, pose_filter, model: (pose_filter, model))
    one, other = ((SimpleNamespace(predictor="tracks", pose_filter=n), SimpleNamespace(model=n)) for n in (1, 2))
    assert certainly_lower(one, other) is lower
    assert seen == [("tracks", [("before", (1, 1)), ("after", (2, 2))])]


MOVES = {
    "nothing": {},
    "b moves a": {"b": "a"},
    "both move a": {"b": "a", "c": "a"},
    "b and c move each other": {"b": "c", "c": "b"},
}


@pytest.mark.parametrize(
    ("moves", "dropped"),
    [("nothing", ("b", "c")), ("b moves a", ("c",)), ("both move a", ()), ("b and c move each other", ("b", "c"))],
)
def test_an_effect_without_which_a_number_that_matters_is_false_is_not_negligible(monkeypatch, moves, dropped):
    of = MOVES[moves]
    monkeypatch.setattr(negligible_module, "_without_each", lambda _one, gone, kept: {n: n for n in ("all", *kept)})
    monkeypatch.setattr(negligible_module, "_errors_of", lambda *_: None)
    monkeypatch.setattr(negligible_module, "shifted", lambda _, lacking, firm: {of[lacking]} & firm if lacking in of else ())
    monkeypatch.setattr(negligible_module, "_shifts", lambda _having, _lacking, numbers: tuple(numbers))
    monkeypatch.setattr(negligible_module, "_largest_fall", lambda _errors, name, _all: {"a": 0.5, "b": 0.001, "c": 0.01}[name])
    assert negligible(SimpleNamespace(accepted=("a", "b", "c"), problem=None)) == dropped
    kept_for = negligible_and_errors(SimpleNamespace(accepted=("a", "b", "c"), problem=None))[2]
    assert kept_for == {name: ("a",) for name in "bc" if name not in dropped}


def fitted_numbers(**effects):
    """A fit of effects by name: value and half the width of the interval of each number, in the order of its parameters."""
    numbers, values, halves = [], [], []
    for name, pairs in effects.items():
        for p, (value, half) in zip(effect_named(name.replace("_", "-")).parameters, pairs, strict=True):
            numbers.append(FreeParameter(name, p))
            values.append(value)
            halves.append(half)
    ends = [(value - half, value + half) for value, half in zip(values, halves, strict=True)]
    return SimpleNamespace(free=tuple(numbers), values=np.array(values), interval=lambda i: ends[i])


@pytest.mark.parametrize(
    ("having", "lacking", "names"),
    [
        ({"dead_zone": [(0.0053, 1e-4)]}, {"dead_zone": [(0.0065, 1e-4)]}, ["width_m_s"]),  # by 23 %, for certain
        ({"dead_zone": [(0.0053, 1e-4)]}, {"dead_zone": [(0.0065, 2e-3)]}, []),  # not for certain
        ({"dead_zone": [(0.0053, 1e-6)]}, {"dead_zone": [(0.0057, 1e-6)]}, []),  # by 8 %
        ({"speed_gain": [(1.05, 1e-4)]}, {"speed_gain": [(1.04, 1e-4)]}, ["gain"]),  # by a fifth of what it does
        ({"speed_gain": [(1.05, 1e-4)]}, {"speed_gain": [(1.046, 1e-4)]}, []),
        ({"speed_limit": [(0.2, 1e-4)]}, {"speed_limit": [(0.17, 1e-4)]}, ["max_m_s"]),
        # the drift to the north is small beside that to the east
        ({"floor_slope": [(0.01, 1e-5), (1e-4, 1e-5)]}, {"floor_slope": [(0.01, 1e-5), (2e-4, 1e-5)]}, []),
        ({"floor_slope": [(0.01, 1e-5), (1e-4, 1e-5)]}, {"floor_slope": [(0.01, 1e-5), (2e-3, 1e-5)]}, ["y_m_s"]),
        ({"speed_gain": [(1.05, 1e-4)], "dead_zone": [(0.01, 1e-4)]}, {"speed_gain": [(1.05, 1e-4)]}, []),
        ({"dead_zone": [(0.0053, 0.0)]}, {"dead_zone": [(0.0065, 1e-4)]}, []),  # an interval without width says nothing
        ({"wheelbase": [(1.05, 1e-4)]}, {"wheelbase": [(1.1, 1e-4)]}, []),  # not one of those that are asked about
    ],
)
def test_a_number_shifts_for_certain_and_by_a_tenth_of_what_its_effect_does(having, lacking, names):
    assert LEAST_SHIFT == 0.1
    asked = {"dead_zone", "speed_gain", "speed_limit", "floor_slope"}
    assert [one.parameter.name for one in shifted(fitted_numbers(**having), fitted_numbers(**lacking), asked)] == names


def test_what_no_error_shows_is_kept_for_the_numbers_that_would_shift(monkeypatch):
    """Two effects, of which neither error nor number of one shows; without the other one that one's number is another."""
    gap, gain = (FreeParameter(name, effect_named(name).parameters[0]) for name in ("dead-zone", "speed-gain"))
    having, lacking = (
        NOMINAL.with_effect("dead-zone", width_m_s=width).with_effect("speed-gain", gain=value)
        for width, value in ((5e-3, 0.99), (6.5e-3, 1.0))
    )
    fits = {"all": SimpleNamespace(model=having), "dead-zone": None, "speed-gain": SimpleNamespace(model=lacking)}
    monkeypatch.setattr(negligible_module, "_without_each", lambda *_: fits)
    monkeypatch.setattr(negligible_module, "_errors_of", lambda *_: "errors")
    monkeypatch.setattr(negligible_module, "_largest_fall", lambda _, name, __: 0.5 if name == "dead-zone" else 0.0)
    monkeypatch.setattr(negligible_module, "shifted", lambda *_: (gap,))
    selection = SimpleNamespace(problem=None, accepted=("dead-zone", "speed-gain"))
    assert gain.of(lacking) == 1.0
    kept = {"speed-gain": (Shift("dead-zone", "width_m_s", "m/s", 5e-3, 6.5e-3),)}
    assert negligible_and_errors(selection) == ((), "errors", kept)
    (said,) = effect_caveats.on_kept(kept)
    assert said.startswith("speed-gain is certain, but without it no error on held-out trials is higher by 2% or more.")
    assert "without it width_m_s of dead-zone would be 0.0065 m/s instead of 0.005: measure one of these" in said
