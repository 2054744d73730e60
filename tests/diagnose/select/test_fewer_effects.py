"""What stands once a search has lost effects: its ties, its words; and what is asked of one effect beside those of a model."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose import beside_terms, outcome
from bns.diagnose import standing as standing_module
from bns.diagnose.adding import warnings_on
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.fit_set import fit_set
from bns.diagnose.estimate.parameters import FreeParameter
from bns.diagnose.estimate.plausibility import does_nothing
from bns.diagnose.predict.paired_errors import PairedErrors
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.report.text import _effects_but, _with_interval, diagnosis_text, enumerated
from bns.diagnose.residuals import restored
from bns.diagnose.residuals.established import Established
from bns.diagnose.residuals.outliers import Outlier
from bns.diagnose.residuals.symbolic import fitted
from bns.diagnose.residuals.unexplained import NOTHING, Unexplained
from bns.diagnose.select import result
from bns.diagnose.select.result import SelectionResult, SelectionStep
from bns.diagnose.select.stepwise import StepwiseSelection
from bns.physics.effects import effect_named
from tests.diagnose.worlds import NOMINAL, hidden, measured


@pytest.fixture(scope="module")
def late():
    return WheelPredictor(tracks_of(measured(hidden(clock_offset={"offset_s": 0.08}), trials=16, seed=3)))


def standing(predictor, *names, competing=()):
    """A result that ended in these effects, as if others had been withdrawn from it."""
    problem, fit, _ = fit_set(predictor, NOMINAL, [effect_named(name) for name in names])
    return SelectionResult(problem, problem.fit(NOMINAL), fit, names, (), competing)


def test_what_competes_with_what_is_left_is_asked_again(late):
    search = StepwiseSelection(late, NOMINAL)
    found = search.competing(standing(late, "clock-offset"))
    assert found.competing_models == (("command-delay",),)
    assert search.competing(found) is found
    nothing = replace(found, accepted=(), competing_models=())
    assert search.competing(nothing) is nothing


def test_beside_terms_only_explanations_of_the_same_likelihood_compete(late, monkeypatch):
    """Held-out losses above and below that of the accepted effect by less and by more than odds of 20 to 1."""
    search, found = StepwiseSelection(late, NOMINAL), standing(late, "clock-offset")
    by = {"same": 0.0, "near": 2.9, "nearer": -2.9, "worse": 3.1, "better": -3.1}
    trials = len(found.fit.held_out)
    others = [((name,), replace(found.fit, held_out=found.fit.held_out + by / trials)) for name, by in by.items()]
    monkeypatch.setattr(search, "_competing_models", lambda *_: others)
    assert search.competing(found).competing_models == tuple((name,) for name in by)
    assert search.competing(found, alike=True).competing_models == (("same",), ("near",), ("nearer",))


@pytest.mark.parametrize(
    ("terms", "lost", "lower", "better"),
    [(1, 2, True, True), (1, 2, False, False), (2, 2, True, False), (1, 1, True, False), (0, 2, True, False)],
)
def test_more_effects_than_terms_that_predict_worse_imitate_however_little_they_leave(monkeypatch, terms, lost, lower, better):
    selection, found = (SimpleNamespace(problem=name, fit=name, terms=("term",) * terms) for name in ("effects", "terms"))
    asked = []
    monkeypatch.setattr(beside_terms, "certainly_lower", lambda *pairs, throughout: asked.append(pairs) or (lower and throughout))
    assert beside_terms.does_better_than_more(found, selection, ("effect",) * lost) is better
    assert all(pairs == (("effects", "effects"), ("terms", "terms")) for pairs in asked)


@pytest.mark.parametrize(
    ("terms", "plausible", "lower", "asked"),
    [(1, True, True, 2), (1, True, False, 1), (1, False, True, 1), (0, False, True, 2), (0, True, True, 2)],
)
def test_effects_that_predict_better_than_terms_stay_unless_their_numbers_are_no_robots(
    late, monkeypatch, terms, plausible, lower, asked
):
    """A search with terms that leaves the accepted effect out; where it stays, terms are sought beside it."""
    calls = []

    def leaving_out(predictor, given, accepted, *_, **__):
        calls.append(tuple(accepted))
        return Established((), ("a term",) * terms, None, None)

    rest = SimpleNamespace(any=True, command_times=None)
    monkeypatch.setattr(beside_terms, "established", leaving_out)
    monkeypatch.setattr(beside_terms, "certainly_lower", lambda *_: lower)
    monkeypatch.setattr(beside_terms, "implausible", lambda *_: "" if plausible else "2 is outside of the plausible range")
    found = beside_terms.sought_terms(standing(late, "clock-offset"), late, rest)
    assert calls == [("clock-offset",), ()][:asked]
    assert found.names == (("clock-offset",) if asked == 2 else ())


def test_an_effect_that_a_term_had_hidden_stands_though_it_lowers_no_error_without_the_term(late, monkeypatch):
    """A turn that is not there: alone it lowers nothing, and is withdrawn where a search accepted it."""
    nothing = standing(late)
    problem = nothing.problem
    term = fitted(problem, nothing.fit, "v", "k * v * abs(w)")
    fit = problem.fit(term.fit.model.with_effect("yaw-bias", rate_rad_s=0.0))
    found = Established(("yaw-bias",), (term,), problem, fit)
    monkeypatch.setattr(outcome, "sought_terms", lambda *given: found if len(given) == 4 else pytest.fail("searched again"))
    monkeypatch.setattr(outcome, "without_absurd", lambda *_: found)
    monkeypatch.setattr(outcome, "terms_matter", lambda _: True)
    monkeypatch.setattr(outcome, "_within_noise", lambda _: False)
    with_terms = lambda errors: any(one.name == beside_terms.WITH_TERMS for one in errors.horizons["trial"].models)  # noqa: E731
    monkeypatch.setattr(PairedErrors, "falls", property(with_terms))
    assert outcome.outcome_of(nothing, late, NOMINAL, lambda _: None).selection.accepted == ("yaw-bias",)


def test_with_fewer_effects_nothing_competes_until_it_is_asked_for(late):
    found = standing(late, "clock-offset", "speed-gain", competing=(("command-delay", "speed-gain"),))
    kept = found.only(("clock-offset",))
    assert (kept.accepted, kept.competing_models) == (("clock-offset",), ())
    assert [active.effect.name for active in kept.fit.model.effects] == ["clock-offset"]
    assert kept.fit.loss == pytest.approx(kept.problem.loss(kept.fit.model))


def test_without_any_effect_before_and_after_are_the_model_as_given_under_its_own_noise(late):
    found = standing(late, "clock-offset", competing=(("command-delay",),))
    for bare in (found.withdrawn(), found.only(())):
        assert (bare.accepted, bare.competing_models, bare.fit.model.effects) == ((), (), ())
        assert bare.nominal is bare.fit
        assert bare.fit.loss == pytest.approx(bare.problem.loss(NOMINAL))
        assert (bare.problem.pose_filter.noise > found.problem.pose_filter.noise).any()  # a late clock looks like noise


@pytest.mark.parametrize(
    ("falls", "fell", "lower", "throughout"),
    [
        (True, [None, True], True, True),
        (True, [False, True], True, False),
        (True, [None, False], False, False),
        (False, [True], False, False),
        (True, [], False, False),
    ],
)
def test_an_error_is_certainly_lower_where_it_falls_as_a_whole_and_for_certain_at_one_horizon(
    monkeypatch, falls, fell, lower, throughout
):
    """Or at all, if that is asked. The errors are mocked; a horizon of too few windows has no total."""
    horizons = {i: SimpleNamespace(total=None if one is None else SimpleNamespace(fell=one)) for i, one in enumerate(fell)}
    monkeypatch.setattr(result, "held_out_steps", lambda *_: None)
    monkeypatch.setattr(result, "paired_errors", lambda *_: SimpleNamespace(falls=falls, horizons=horizons))
    one = SimpleNamespace(predictor=None, pose_filter=None), SimpleNamespace(model=None)
    assert result.certainly_lower(one, one) is lower
    assert result.certainly_lower(one, one, throughout=True) is throughout


@pytest.mark.parametrize(("added", "first"), [(effect_named("clock-offset"), ("clock-offset",)), (None, ())])
def test_clocks_are_named_before_what_was_found_beside_them_unless_the_model_had_one(late, added, first):
    search, found = StepwiseSelection(late, NOMINAL), standing(late, "speed-gain", competing=(("wheelbase",),))
    clock = NOMINAL.with_effect("clock-offset", offset_s=0.0)
    search.model = SimpleNamespace(per_trial_effect=clock.effects[0])
    clocks = SimpleNamespace(fit="the clocks' fit", paired_comparison="what they earned")
    ended = search._with_clocks(replace(found, steps=(_step("speed-gain"), _step(""))), "nominal", clocks, added)
    assert (ended.accepted, ended.competing_models) == ((*first, "speed-gain"), ((*first, "wheelbase"),))
    assert [[c.name for c in step.ranking] for step in ended.steps] == [["clock-offset", "speed-gain"], [""]]
    assert ended.nominal == "nominal"


def _step(name):
    return SelectionStep((SimpleNamespace(name=name),), 0.0, name)


@pytest.mark.slow
def test_a_diagnosis_whose_search_lost_an_effect_keeps_its_tie(late, monkeypatch):
    """A stand-in for the judgement that withdraws: of a clock and a gain, the gain goes, with all that competed with both."""
    plain = outcome.outcome_of

    def losing(searched, *rest):
        assert set(searched.accepted) & {"clock-offset", "command-delay"}
        found = plain(searched, *rest)
        kept = found.selection.only(found.selection.accepted)
        return replace(found, selection=kept, withdrawn=("speed-gain",))

    monkeypatch.setattr("bns.diagnose.diagnosing.outcome_of", losing)
    found = diagnose(late, NOMINAL)
    assert found.verdict == "tie"
    assert {*found.effects, *found.selection.competing_models[0]} == {"clock-offset", "command-delay"}


@pytest.mark.slow
@pytest.mark.parametrize("terms", [(), ("a term",)])
def test_beside_terms_too_it_is_asked_what_competes(late, monkeypatch, terms):
    """A stand-in for the judgement; the answer is what the search is asked, and ends there."""

    class AskedError(Exception):
        pass

    def asked(_search, _selection, alike):
        raise AskedError(alike)

    plain = outcome.outcome_of
    monkeypatch.setattr(
        "bns.diagnose.diagnosing.outcome_of", lambda *given: replace(plain(*given), withdrawn=("speed-gain",), terms=terms)
    )
    monkeypatch.setattr(StepwiseSelection, "competing", asked)
    with pytest.raises(AskedError) as ended:
        diagnose(late, NOMINAL)
    assert ended.value.args == (bool(terms),)


def test_an_unlisted_verdict_names_what_cannot_be_told_from_an_effect(late):
    rest = Unexplained((), None, ())
    tied = standing(late, "clock-offset", competing=(("command-delay",),))
    said = diagnosis_text(Diagnosis("unlisted", replace(tied, steps=_no_steps()), rest=rest)).splitlines()[1]
    assert said == "Missing from the model: clock-offset (or command-delay), and something that no listed effect explains."


def _no_steps():
    return (SimpleNamespace(ranking=(), decoy_threshold=0.0, selected="", passed_over="", of=0, instead_of=""),)


@pytest.mark.parametrize(
    ("moments", "said"),
    [(3, "the error is large for a moment"), (9, "the error is large at some moments, too often for accidents")],
)
def test_moments_in_many_trials_are_the_rule(late, moments, said):
    outlier = next(iter(_outliers(1)))
    found = Diagnosis("unlisted", standing(late, "clock-offset"), rest=Unexplained((), None, (outlier,) * moments))
    assert found.behaviour[0].startswith(f"in {moments} of 16 trials {said}; the worst is ")


def _outliers(count):
    fields = dict.fromkeys(Outlier.__dataclass_fields__, 0.0)
    for _ in range(count):
        yield Outlier(**fields | {"trial": "3"})


def test_names_are_enumerated():
    assert [enumerated(names) for names in ((), ("a",), ("a", "b"), ("a", "b", "c"))] == ["", "a", "a and b", "a, b and c"]


def test_a_number_without_an_interval_says_why():
    number = {"value": 50.0, "low": 50.0, "high": 50.0, "unit": "1"}
    said = _with_interval("force-limit", "turn_ratio", number)
    assert said.endswith("= 50 (no interval: one trial only, or no small change changes the loss)")
    said = _with_interval("force-limit", "turn_ratio", number | {"at_bound": True})
    assert said.endswith("= 50 (no interval: it is at the bound of what it can be)")
    assert _with_interval("motor-lag", "tau_s", number | {"low": 40.0, "unit": "s"}).endswith("= 50 s (95 %: 40 to 50)")
    place = {"value": 901.000771, "low": 900.998018, "high": 901.004884, "unit": "m"}  # 7 mm, a share of 8e-6
    assert _with_interval("floor-patch", "x_m", place).endswith("x_m = 901.0008 m (95 %: 900.998 to 901.0049)")
    assert _with_interval("force-limit", "turn_ratio", number | {"low": 49.999999}).endswith("no small change changes the loss)")


@pytest.mark.parametrize(
    ("above", "value", "again"),
    [({"low": 1.0, "high": 1.2}, 1.2, False), ({"low": 1.0, "high": 1.2}, 1.21, True), ({"low": None, "high": None}, 1.1, True)],
)
def test_of_another_explanation_only_what_differs_is_written(above, value, again):
    number = {"value": value, "low": value - 0.1, "high": value + 0.1, "unit": "1"}
    known = {name: effect_named(name) for name in ("wheelbase", "speed-gain")}
    other = {"wheelbase": {"factor": number}, "speed-gain": {"gain": number}}
    said = list(_effects_but({"wheelbase": {"factor": above}}, other, known))
    assert ("  wheelbase: as above" in said) is not again
    assert any(line.startswith("    factor = ") for line in said) is again
    assert any(line.startswith("    gain = ") for line in said)  # it is not in the explanation above


def test_a_limit_that_is_found_does_something_whatever_its_ratio():
    robot = hidden(acceleration_limit={"max_m_s2": 0.3})
    predictor = WheelPredictor(tracks_of(measured(robot, trials=12, seed=3, speeds=(-0.2, 0.2))))
    effect = effect_named("force-limit")
    _, fit, _ = fit_set(predictor, NOMINAL, [effect])
    low, high = fit.interval([f.parameter.name for f in fit.free].index("turn_ratio"))
    assert low < 1.0 < high
    assert not does_nothing(fit, "force-limit")


def test_a_bare_number_at_its_bound_has_no_unit():
    ratio = next(p for p in effect_named("force-limit").parameters if p.name == "turn_ratio")
    limit = effect_named("force-limit").parameters[0]
    fit = SimpleNamespace(
        free=(FreeParameter("force-limit", limit), FreeParameter("force-limit", ratio)),
        values=np.array([0.3, ratio.high]),
        interval=lambda index: (0.2, 0.4) if index == 0 else (10.0, 50.0),
    )
    errors = SimpleNamespace(trials=12, horizons={"1s": SimpleNamespace(models=())})
    said = list(warnings_on(fit, [(effect_named("force-limit"), {})], errors))
    assert any(one.startswith("force-limit: turn_ratio is at its bound, 50: the data require") for one in said)


def test_a_jump_of_the_loss_in_one_trial_is_no_slope(late, monkeypatch):
    """Beyond the number's place something is reset in trial 4, as the filter does in a trial that goes astray."""
    problem, fit, _ = fit_set(late, NOMINAL, [effect_named("motor-lag")])
    plain, place = problem.whitened, fit.model.values_of("motor-lag")["tau_s"]
    there = late.tracks.trial == 4

    def jumping(model):
        out = plain(model).copy()
        if model.values_of("motor-lag")["tau_s"] > place:
            out[there] += 50.0
        return out

    monkeypatch.setattr(problem, "whitened", jumping)
    at = problem._point(fit.model)
    slope = problem._slope(at, fit.free, 0, 1e-3)
    np.testing.assert_allclose(slope[there], (at.whitened - plain(_moved(fit, -1e-3)))[there] / 1e-3)
    np.testing.assert_allclose(slope[~there], (plain(_moved(fit, 1e-3)) - at.whitened)[~there] / 1e-3)


def _moved(fit, by):
    return fit.model.with_values({"motor-lag": {"tau_s": fit.model.values_of("motor-lag")["tau_s"] + by}})


@pytest.mark.slow
def test_where_an_effect_only_imitates_the_simpler_one_that_it_extends_is_asked_again(late, monkeypatch):
    searched = standing(late, "clock-offset", "inertia-lag")
    shorter = standing_module.with_parts(searched, ("clock-offset",))
    assert shorter.accepted == ("clock-offset", "motor-lag")
    assert {a.effect.name for a in shorter.fit.model.effects} == {"clock-offset", "motor-lag"}
    assert standing_module.with_parts(searched, searched.accepted) is None
    given = NOMINAL.with_effect("motor-lag", tau_s=0.1)
    problem, fit, _ = fit_set(late, given, [effect_named("inertia-lag")])  # the model's own comes back by itself
    assert standing_module.with_parts(SelectionResult(problem, problem.fit(given), fit, ("inertia-lag",), ()), ()) is None

    asked, seen = [], []
    monkeypatch.setattr(standing_module, "may_be_neutral", lambda _: "")  # neither lag is there

    def found_beside(stays, selection, *_):
        asked.append(selection.accepted)
        kept = tuple(name for name in selection.accepted if name in stays)
        return Established(kept, (), selection.problem, selection.fit)

    monkeypatch.setattr(beside_terms, "_without_negligible", lambda found, selection, _: seen.append(selection.accepted) or found)
    for stays, accepted in (({"clock-offset", "motor-lag"}, shorter.accepted), ({"clock-offset"}, searched.accepted)):
        for module in (outcome, beside_terms):
            monkeypatch.setattr(module, "sought_terms", partial(found_beside, stays))
        outcome.outcome_of(searched, late, NOMINAL, lambda _: None)
        assert asked[-2:] == [searched.accepted, shorter.accepted]
        assert seen[-1] == accepted


@pytest.mark.parametrize(
    ("certain", "share"),
    [((True, True), 0.5), ((True, False), 0.8), ((False, True), 0.5), ((False, False), 1.0)],
)
def test_a_curve_that_predicts_better_by_luck_does_not_bar_an_effect(monkeypatch, certain, share):
    """Near, the effect takes away 0.8 of what the curve takes away, far 0.5; each counts where the difference is certain."""
    rms_m = {"near": {"bare": 0.02, "effects": 0.012, "terms": 0.01}, "far": {"bare": 0.1, "effects": 0.09, "terms": 0.08}}

    def errors_of(_, judged):
        assert [name for name, _ in judged] == ["bare", "effects", "terms"]
        changes = dict(zip(rms_m, certain, strict=True))
        return SimpleNamespace(
            horizons={
                h: SimpleNamespace(change_between=lambda *names, h=h: SimpleNamespace(fell=names == PAIR and changes[h]))
                for h in rms_m
            },
            of=lambda name: {h: SimpleNamespace(rms_m=by_model[name]) for h, by_model in rms_m.items()},
        )

    monkeypatch.setattr(restored, "paired_errors", errors_of)
    monkeypatch.setattr(restored, "held_out_steps", lambda *_: None)
    fit = SimpleNamespace(model=None)
    effects = SimpleNamespace(fit=fit, problem=SimpleNamespace(pose_filter=None))
    assert restored._least_share_m(None, effects, fit, fit) == pytest.approx(share)


PAIR = ("effects", "terms")


@pytest.mark.parametrize("left", [True, False])
def test_terms_are_searched_again_beside_the_effects_that_stand(late, monkeypatch, left):
    """With mocked parts: the terms were fitted beside two effects, one of which raises the error; ``left``: something is left."""
    both, kept = standing(late, "wheelbase", "speed-gain"), standing(late, "wheelbase")
    rest = replace(NOTHING, residual_dependence=("something",))
    stands, next_to = (standing_module.Standing(one, None, (), [], rest) for one in (both, kept))
    first = Established(both.accepted, ("a term",), both.problem, both.fit)
    second = Established(kept.accepted, ("another",), kept.problem, kept.fit)
    errors, asked = SimpleNamespace(falls=True, falls_in_the_end=False), []
    monkeypatch.setattr(outcome, "standing_of", lambda *_: stands)
    monkeypatch.setattr(outcome, "beside_the_floor", lambda *_: (stands, ()))
    monkeypatch.setattr(outcome, "sought_terms", lambda *_: first)
    monkeypatch.setattr(outcome, "standing_beside", lambda *_: (replace(next_to, withdrawn=("speed-gain",)), (), (), errors))
    monkeypatch.setattr(outcome, "terms_matter", lambda _: True)
    monkeypatch.setattr(outcome, "_within_noise", lambda _: False)
    monkeypatch.setattr(outcome, "best_formula", lambda *_: None)

    def again(selection, _predictor, rest, _response, barred):
        asked.append((selection.accepted, rest, set(barred) >= {"speed-gain", "clock-offset", "wheelbase"}))
        return second if left else None

    monkeypatch.setattr(beside_terms, "sought_terms", again)
    monkeypatch.setattr(beside_terms, "standing_beside", lambda *_: (next_to, (), (), errors))
    for module in (outcome, beside_terms):
        monkeypatch.setattr(module, "without_absurd", lambda found, *_: found)
    ended = outcome.outcome_of(both, late, NOMINAL, lambda _: None)
    assert asked == [(("wheelbase",), rest, True)]
    assert (ended.selection.accepted, ended.withdrawn) == (("wheelbase",), ("speed-gain",))
    assert ended.terms == (("another",) if left else ())
