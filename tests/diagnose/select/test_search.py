"""Verdicts on small worlds, end to end."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bns.diagnose import diagnosing
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import _from_better_numbers, diagnose
from bns.diagnose.estimate.plausibility import implausible
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import fit_with, listed
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals import earned_terms as curves
from bns.diagnose.residuals.earned_terms import curve_does_better
from bns.diagnose.select.acceptance import Acceptance
from bns.diagnose.select.result import SelectionResult, SelectionStep
from bns.diagnose.select.stepwise import StepwiseSelection
from bns.physics.decoys import DECOYS
from bns.physics.effects import all_effects, effect_named
from bns.physics.formula import formula_effect
from bns.physics.model import ActiveEffect
from tests.diagnose.worlds import NOMINAL, all_but_rivals_of, hidden, measured


def diagnosed(model, barred=(), **how):
    predictor = WheelPredictor(tracks_of(measured(model, **{"trials": 20, "seed": 11} | how)))
    return diagnose(predictor, NOMINAL, barred=barred)


def test_nothing_is_found_where_nothing_is_hidden():
    found = diagnosed(NOMINAL)
    assert (found.verdict, found.effects) == ("none", ())
    error = found.as_json()["error"]["1s"]
    assert error["before"] == error["after"]


def test_one_effect_is_named_with_its_size():
    answer = diagnosed(hidden(wheelbase={"factor": 1.05})).as_json()
    assert (answer["verdict"], answer["effects"], answer["ties"]) == ("effects", ["wheelbase"], [])
    factor = answer["parameters"]["wheelbase"]["factor"]
    assert factor["low"] < 1.05 < factor["high"]
    assert not factor["at_bound"]
    assert answer["ranking"][0]["name"] == "wheelbase"
    assert answer["error"]["command"]["after"] < 0.8 * answer["error"]["command"]["before"]


@pytest.mark.slow
def test_a_late_command_ties_with_a_late_clock():
    answer = diagnosed(hidden(command_delay={"delay_s": 0.08}), all_but_rivals_of("clock-offset", "command-delay")).as_json()
    assert answer["verdict"] == "tie"
    assert answer["ties"] == [["clock-offset", "command-delay"]]
    assert sorted(map(tuple, answer["explanations"])) == [("clock-offset",), ("command-delay",)]
    assert any("look the same in a log" in note for note in answer["notes"])


@pytest.mark.slow
def test_an_early_clock_is_no_late_command():
    answer = diagnosed(hidden(clock_offset={"offset_s": -0.08}), all_but_rivals_of("clock-offset", "command-delay")).as_json()
    assert (answer["verdict"], answer["effects"]) == ("effects", ["clock-offset"])
    assert any(note.startswith("clock-offset is an error of the measurement, or else") for note in answer["notes"])


@pytest.mark.slow
def test_what_no_list_holds_is_called_so_and_a_formula_offered():
    rough = formula_effect("rough", "k * v * exp(-tau / 3)", "v")
    model = NOMINAL.with_active(rough, (-0.12,))
    answer = diagnosed(model, all_but_rivals_of("speed-gain")).as_json()
    assert answer["verdict"] == "unlisted"
    assert answer["residual_dependence"][0]["variable"] in {"time_in_trial_s", "way_m"}
    assert answer["formula"]["on"] == "v"
    assert answer["formula"]["elpd_diff"] > 0


@pytest.mark.slow
def test_a_model_that_has_the_effect_already_lacks_nothing():
    table = measured(hidden(wheelbase={"factor": 1.05}), trials=20, seed=11)
    model = NOMINAL.with_effect("wheelbase", factor=1.0)
    found = diagnose(WheelPredictor(tracks_of(table)), model, barred=all_but_rivals_of("wheelbase"))
    assert found.verdict == "none"
    assert found.as_json()["parameters"]["wheelbase"]["factor"]["value"] == pytest.approx(1.05, abs=0.01)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t[t.trial == 0], r"^1 trial: anything"),
        (lambda t: t[t.trial < 10], r"^10 trials: .* At least 12 trials are needed"),
        (lambda t: t.groupby("trial").head(1), "only one tracked pose"),
        (lambda t: t.assign(left_m_s=0.0, right_m_s=0.0), "never commanded to move"),
        (lambda t: t.assign(x_m=0.1, y_m=0.2), "never moved by more than 5 mm"),
    ],
)
def test_too_little_is_said_to_be_so(change, message):
    found = diagnose(WheelPredictor(tracks_of(change(measured(NOMINAL, trials=12)))), NOMINAL)
    assert found.verdict == "insufficient-data"
    assert any(re.search(message, note) for note in found.notes)


def test_a_search_with_the_trials_clocks_starts_from_the_model_given():
    clock = effect_named("clock-offset")
    given = NOMINAL.with_effect("speed-gain", gain=0.9)
    fitted = given.with_effect("wheelbase", factor=1.1)
    fitted = replace(fitted, effects=(*fitted.effects, ActiveEffect(clock, (0.15,), per_trial=True, trial_values=(0.1, 0.2))))
    assert fitted.per_trial_effect is not None
    bare = StepwiseSelection._bare_with_clocks(fitted, given)
    assert {active.effect.name for active in bare.effects} == {"speed-gain", "clock-offset"}
    assert {active.effect.name for active in StepwiseSelection._bare_with_clocks(given, given).effects} == {"speed-gain"}


def test_decoys_move_the_robot_but_mean_nothing():
    predictor = WheelPredictor(tracks_of(measured(NOMINAL, trials=4)))
    still = predictor.steps(NOMINAL).body
    for decoy in DECOYS:
        model = NOMINAL.with_active(decoy, (0.1,))
        assert isinstance(model.effects[0], ActiveEffect)
        assert np.abs(predictor.steps(model).body - still).max() > 1e-5


@pytest.mark.parametrize(("name", "values"), [("turn-slip", {"slip_s": 0.12}), ("side-slip", {"slip_s": 0.1})])
def test_where_trials_repeat_the_same_commands_no_decoy_does_what_the_effect_does(name, values):
    """What happens in another trial is then what happens in this one."""
    one = measured(NOMINAL.with_effect(name, **values), trials=1, seed=11, noise=(0.0, 0.0), jitter=0.0, commands=8)
    table = pd.concat([one.assign(trial=number) for number in range(12)], ignore_index=True)
    noise = np.random.default_rng(5).normal(size=(len(table), 3)) * [0.0015, 0.0015, 0.005]
    table[["x_m", "y_m", "heading_rad"]] += noise
    search = StepwiseSelection(WheelPredictor(tracks_of(table)), NOMINAL, barred=all_but_rivals_of(name))
    found = search.run()
    assert found.accepted == (name,)
    (gain,) = (c.paired_comparison.elpd_diff for c in found.steps[0].ranking if c.name == name)
    assert found.steps[0].decoy_threshold < 0.2 * gain


@pytest.mark.parametrize(("late", "stays"), [((3, 5, 12), False), (range(16), True)])
def test_a_few_late_trials_do_not_bring_a_clock_in_by_exchange(late, stays):
    table = measured(NOMINAL, seed=11)
    seen, shifted = ["x_m", "y_m", "heading_rad"], table["trial"].isin(late)
    table.loc[shifted, seen] = table[shifted].groupby("trial")[seen].shift(3).bfill()
    search = StepwiseSelection(WheelPredictor(tracks_of(table)), NOMINAL)
    problem, fit = search._refit_with_noise(NOMINAL)
    tried = fit_with(problem, fit, search.catalogue["clock-offset"])
    assert tried.held_out.sum() < fit.held_out.sum() - 0.5
    assert search._acceptance.may_stay(problem, tried, "clock-offset") is stays


def test_numbers_that_are_known_are_one_start_more(monkeypatch):
    """A patch of floor has many valleys; from a start beside it, it is not found."""
    true = hidden(floor_patch={"x_m": 0.1, "y_m": -0.05, "radius_m": 0.15, "loss": 0.4})
    predictor = WheelPredictor(tracks_of(measured(true, trials=20, seed=11)))
    problem = problem_for(predictor, NOMINAL)
    base, effect = problem.fit(NOMINAL), listed(NOMINAL, None, predictor.tracks)["floor-patch"]
    monkeypatch.setattr("bns.diagnose.estimate.starts._starts", lambda *_: iter([(-0.5, 0.5, 0.1, 0.1)]))
    known = NOMINAL.with_active(effect, (0.1, -0.05, 0.15, 0.4))
    alone, helped = (fit_with(problem, base, effect, model) for model in (None, known))
    assert helped.loss < alone.loss - 1.0
    assert helped.model.values_of("floor-patch")["loss"] == pytest.approx(0.4, abs=0.02)


@pytest.mark.parametrize(
    ("name", "values", "competing_models"), [("turn-slip", {"slip_s": 0.0}, 0), ("camera-scale", {"factor": 1.0}, 1)]
)
def test_a_rival_must_have_earned_its_place(monkeypatch, name, values, competing_models):
    table = measured(hidden(camera_scale={"factor": 1.05}), seed=11)
    search = StepwiseSelection(WheelPredictor(tracks_of(table)), NOMINAL)
    problem, fit = search._refit_with_noise(NOMINAL.with_effect("camera-scale", factor=1.05))
    tried = problem.fit(NOMINAL.with_effect(name, **values))
    monkeypatch.setattr("bns.diagnose.select.stepwise.indistinguishable", lambda *_: True)
    monkeypatch.setattr(search._exchanges, "of", lambda *_: [("camera-scale", name, tried)])
    assert len(search._competing_models(problem, fit, ("camera-scale",))) == competing_models


@pytest.mark.slow
def test_what_asks_for_too_much_once_noise_and_numbers_have_settled_is_passed_over(monkeypatch):
    def rejected_because(fit, name, bounds=True):
        return "too much" if name == "wheelbase" and not bounds else implausible(fit, name, bounds)

    monkeypatch.setattr(Acceptance, "rejected", lambda _, fit, name, bounds=True: rejected_because(fit, name, bounds))
    tracks = tracks_of(measured(hidden(wheelbase={"factor": 1.05}), trials=12, seed=11))
    found = StepwiseSelection(WheelPredictor(tracks), NOMINAL, barred=all_but_rivals_of("wheelbase")).run()
    first = found.steps[0].ranking[0]
    assert (first.name, first.rejected_because) == ("wheelbase", "too much")
    assert "wheelbase" not in found.accepted


def test_slopes_of_a_smaller_model_lead_to_the_same_fit():
    table = measured(hidden(motor_lag={"tau_s": 0.08}, wheelbase={"factor": 1.04}), trials=8, seed=5)
    search = StepwiseSelection(WheelPredictor(tracks_of(table)), NOMINAL)
    problem, base = search._refit_with_noise(NOMINAL.with_effect("wheelbase", factor=1.0))
    start = base.model.with_effect("motor-lag", tau_s=0.03).arranged()
    anew, known = problem.fit(start), problem.fit(start, nearby=base.jacobian_by_parameter)
    assert known.loss == pytest.approx(anew.loss, abs=0.02)
    errors = np.sqrt(np.diag(anew.covariance))
    assert (np.abs(known.values - anew.values) < 0.3 * errors).all()  # a loss of a hundredth is as good as settled
    np.testing.assert_allclose(np.sqrt(np.diag(known.covariance)), errors, rtol=0.05)


def test_the_newest_is_dropped_where_an_exchange_left_it_nothing_to_do():
    """At its bound it moves nothing: presented, it would read as a delay of 0 s."""
    predictor = WheelPredictor(tracks_of(measured(NOMINAL, trials=12, seed=1)))
    search = StepwiseSelection(predictor, NOMINAL)
    idle = NOMINAL.with_effect("command-delay", delay_s=0.0)
    problem = problem_for(predictor, idle)
    assert search._look_back.backward_step(problem, problem.fit(idle, 0), ("command-delay",))[2] == ()


def test_the_same_effects_take_the_numbers_that_fit_better():
    """A patch of floor has many valleys; another search on nearly the same trials may have ended in a deeper one."""
    predictor = WheelPredictor(tracks_of(measured(hidden(wheelbase={"factor": 1.05}), trials=12, seed=1)))
    problem = problem_for(predictor, NOMINAL)
    off, right = (problem.fit(NOMINAL.with_effect("wheelbase", factor=f), rounds) for f, rounds in ((1.02, 0), (1.05, None)))
    ends = [SelectionResult(problem, off, fit, ("wheelbase",), (), ()) for fit in (off, right)]
    assert _from_better_numbers(ends[0], ends[1]).fit.loss <= right.loss
    assert _from_better_numbers(ends[1], ends[0]).fit is right
    assert _from_better_numbers(ends[0], replace(ends[1], accepted=("motor-lag",))).fit is off
    assert _from_better_numbers(ends[0], None).fit is off


def searched(table, *left_out):
    predictor = WheelPredictor(tracks_of(table))
    return StepwiseSelection(predictor.not_counting(left_out) if left_out else predictor, NOMINAL)


@pytest.fixture(scope="module")
def with_a_gain():
    table = measured(hidden(speed_gain={"gain": 0.96}), trials=20, seed=11)
    search = searched(table)
    return table, search, search.run()


@pytest.mark.slow
def test_the_end_of_a_search_stands_without_one_trial(with_a_gain):
    table, _, end = with_a_gain
    again = searched(table, 3)
    stood, anew = again.stands(end), searched(table, 3).run()
    assert stood.accepted == anew.accepted == end.accepted == ("speed-gain",)
    np.testing.assert_allclose(stood.fit.values, anew.fit.values, rtol=1e-5)
    assert stood.competing_models == anew.competing_models
    assert [step.selected for step in stood.steps] == [step.selected for step in anew.steps]
    assert stood.fit.losses[3] == 0.0
    assert end.fit.losses[3] > 0.0


@pytest.mark.slow
def test_an_end_does_not_stand_where_an_effect_would_go_come_or_be_exchanged(with_a_gain, monkeypatch):
    table, search, end = with_a_gain

    def ended(*names):
        problem, fit = end.problem, end.nominal
        for name in names:
            fit = fit_with(problem, fit, search.catalogue[name])
        return replace(end, accepted=names, fit=fit)

    assert searched(table).stands(ended("speed-gain")) is not None
    assert searched(table).stands(ended("speed-gain", "warm-up")) is None
    assert searched(table).stands(ended("wheel-mismatch")) is None
    two = measured(hidden(speed_gain={"gain": 0.96}, wheelbase={"factor": 1.05}), trials=20, seed=11)
    assert searched(two).stands(ended("speed-gain")) is None
    assert searched(table).stands(replace(end, accepted=())) is None
    exchanging = searched(table)
    monkeypatch.setattr(exchanging._look_back, "exchange_step", lambda problem, fit, _: (problem, fit, ("warm-up",)))
    assert exchanging.stands(end) is None


def test_what_could_stand_in_place_of_the_newest_effect_is_known_from_the_round_in_which_it_came(with_a_gain, monkeypatch):
    _, search, end = with_a_gain
    fits = {}
    for known in (True, False):
        search._exchanges.forget()
        with monkeypatch.context() as patched:
            if known:  # no start is looked for again
                patched.setattr("bns.diagnose.select.exchanges.best_start", lambda *_: pytest.fail("looked for"))
            else:
                patched.setattr(search._exchanges, "entry", None)
            found = search._exchanges.of(end.problem, end.fit, end.accepted)
        fits[known] = {name: fit.loss for _, name, fit in found}
    assert set(fits[False]) <= set(fits[True])
    assert fits[False]
    assert {name: fits[True][name] for name in fits[False]} == pytest.approx(fits[False], rel=1e-3)


@pytest.mark.parametrize(
    ("change", "hinted"),
    [
        ({}, True),
        ({"z": 1.9}, False),
        ({"z": -3.0}, False),
        ({"p_value": 0.2}, False),
        ({"p_value": 0.04}, False),  # taken, had not another one stood for it
        ({"p_value": 0.04, "z": 2.4}, True),
        ({"elpd_diff": 0.4}, False),  # a decoy does better
        ({"losses": 1e4}, False),  # nothing beside what is lost anyway
        ({"rejected_because": "at its bound"}, False),
        ({"accepted": ("wheelbase",)}, False),
        ({"trials": diagnosing.FEW_TRIALS}, False),
        ({"unexplained": True}, False),
    ],
)
def test_a_sign_is_worth_more_trials_only_where_few_nearly_sufficed(change, hinted):
    given = {"z": 3.0, "p_value": 0.1, "elpd_diff": 1.0, "losses": 9.0, "rejected_because": "", "accepted": (), "trials": 12}
    given["unexplained"] = False
    given |= change
    earned = SimpleNamespace(p_value=given["p_value"], z=given["z"], elpd_diff=given["elpd_diff"])
    candidate = SimpleNamespace(name="turn-slip", rejected_because=given["rejected_because"], paired_comparison=earned)
    nominal = SimpleNamespace(losses=np.full(12, given["losses"]))
    of_wheels = SimpleNamespace(predictor=SimpleNamespace(luck=None))
    steps = (SelectionStep((candidate,), 0.5, ""),)
    found = SimpleNamespace(accepted=given["accepted"], steps=steps, nominal=nominal, problem=of_wheels)
    assert (diagnosing._hint(found, given["trials"], unexplained=given["unexplained"]) is candidate) is hinted


@pytest.mark.parametrize("better", [(False,), (True, True, True), (True, False)])
def test_beside_several_effects_the_search_ends_where_a_curve_does_better(monkeypatch, better):
    """What is on no list is imitated by one effect after the other, and each is sought longer than the one before.

    But a curve that does better than the next effect has to do better than all that would follow it, too.
    """
    monkeypatch.setattr("bns.diagnose.select.forwards.CURVE_FROM", 1)
    asked = []

    def curve_does_better(problem, fit, added):
        asked.append({f.effect for f in added.free} - {f.effect for f in fit.free})
        assert added.loss < fit.loss == pytest.approx(problem.loss(fit.model))
        return better[len(asked) - 1]

    predictor = WheelPredictor(tracks_of(measured(hidden(speed_gain={"gain": 0.96}, wheelbase={"factor": 1.08}), seed=11)))
    others = set(all_effects()) - {"speed-gain", "wheelbase", "motor-lag"}
    search = StepwiseSelection(predictor, NOMINAL, barred=others, curve_does_better=curve_does_better)
    found = search.run()
    ends = all(better)
    assert len(found.accepted) == (1 if ends else 2)
    assert [step.selected != "" for step in found.steps] == [True, *([] if ends else [True]), False]
    assert asked[0] == {"speed-gain", "wheelbase"} - set(found.accepted[:1])
    assert len(asked) == len(better[:2])
    if ends:
        better = (True,) * 9
        assert len(found.steps[-1].ranking) == 2
        again = search.stands(found)
        assert again is not None
        assert again.accepted == found.accepted


@pytest.mark.parametrize("names", [("wheelbase",), ("wheelbase", "motor-lag"), ("wheelbase", "motor-lag", "side-slip")])
@pytest.mark.parametrize("unlisted", [False, True])
def test_curves_do_better_only_than_effects_that_are_not_there(monkeypatch, unlisted, names):
    asked, better_term = [], curves.better_term
    monkeypatch.setattr(curves, "better_term", lambda *which: asked.append(which) or better_term(*which))
    true = hidden(wheelbase={"factor": 1.05}, motor_lag={"tau_s": 0.15}, side_slip={"slip_s": 0.1})
    if unlisted:
        true = NOMINAL.with_active(formula_effect("rough", "k * exp(-tau / 2)", "share"), (-0.15,))
    predictor = WheelPredictor(tracks_of(measured(true, trials=20, seed=11)))
    left = [active for active in true.effects if active.effect.name not in names and not unlisted]
    model = replace(NOMINAL, effects=tuple(left))  # with what is there, but for the effects that are asked about
    problem = problem_for(predictor, model)
    fit = added = problem.fit(model)
    for name in names:
        added = fit_with(problem, added, listed(NOMINAL, None, predictor.tracks)[name])
    assert curve_does_better(problem, fit, added) is unlisted
    if unlisted:
        assert (len(asked) == 1) is (len(names) == 1)  # of several effects, a second term is asked for
    clocks = SimpleNamespace(model=SimpleNamespace(per_trial_effect="clock-offset"))
    assert not curve_does_better(problem, clocks, added)


def test_what_a_search_has_tried_is_kept_without_what_is_as_large_as_the_log(with_a_gain):
    _, _, found = with_a_gain
    tried = [candidate.fit for step in found.steps for candidate in step.ranking]
    assert len(found.steps) > 1
    assert all(fit.whitened.size == fit.jacobian.size == 0 for fit in tried)
    assert all(len(fit.values) == len(fit.free) == fit.jacobian.shape[2] for fit in tried)


def test_a_search_without_clocks_of_the_trials_begins_where_the_one_with_them_did(with_a_gain, monkeypatch):
    asked, select = [], StepwiseSelection._select
    monkeypatch.setattr(StepwiseSelection, "_select", lambda search: asked.append(search) or select(search))
    predictor, others = WheelPredictor(tracks_of(with_a_gain[0])), set(all_effects()) - {"speed-gain", "motor-lag"}
    search = StepwiseSelection(predictor, NOMINAL, barred=others)
    found = search.run()
    assert StepwiseSelection(predictor, NOMINAL, barred=others, own_clocks=False, begun=search).run() is found
    assert asked == [search]
    again = StepwiseSelection(predictor, NOMINAL, barred=others)
    again.run(found)  # the end of a search on nearly the same is no beginning
    StepwiseSelection(predictor, NOMINAL, barred=others, own_clocks=False, begun=again).run()
    assert len(asked) == 2


def test_a_bold_search_is_another_one(with_a_gain):
    predictor, others = WheelPredictor(tracks_of(with_a_gain[0])), set(all_effects()) - {"speed-gain", "motor-lag"}
    search = StepwiseSelection(predictor, NOMINAL, barred=others)
    found = search.run()
    search._acceptance.all_believed = True
    assert search._run() is not found
    assert search._plain is found


SEVERAL = {
    "camera_scale": {"factor": 1.03}, "dead_zone": {"width_m_s": 0.008},
    "marker_offset": {"forward_m": 0.008, "left_m": -0.006}, "motor_lag": {"tau_s": 0.12}, "speed_limit": {"max_m_s": 0.15},
    "turn_slip": {"slip_s": 0.05}, "wheel_mismatch": {"ratio": 0.97},
}  # fmt: skip
BESIDE = {name.replace("_", "-") for name in SEVERAL} | {
    "acceleration-limit", "battery-sag", "camera-rotation", "clock-offset", "command-delay", "force-limit", "heading-delay",
    "side-slip", "speed-gain", "stribeck", "tilted-camera", "understeer", "wheelbase", "yaw-bias",
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "names"),
    [
        (3, ("camera_scale", "dead_zone", "turn_slip", "wheel_mismatch")),
        (12, ("camera_scale", "marker_offset", "motor_lag", "speed_limit", "turn_slip")),
    ],
)
def test_a_curve_that_does_better_than_the_next_effect_does_not_hide_several(seed, names):
    """Beside three effects, one of which is wrong or another of which is missing, a curve does better than the fourth alone.

    Of a third of the list: with all of it a search takes minutes.
    """
    true = hidden(**{name: SEVERAL[name] for name in names}).arranged()
    predictor = WheelPredictor(tracks_of(measured(true, trials=40, seed=seed)))
    found = diagnose(predictor, NOMINAL, barred=sorted(set(all_effects()) - BESIDE))
    assert (found.verdict, set(found.effects)) == ("effects", {name.replace("_", "-") for name in names})


def test_a_search_looks_ahead_to_all_effects_that_would_come_in():
    """Three that are there; a fourth that is not is left out."""
    true = hidden(speed_gain={"gain": 0.95}, wheelbase={"factor": 1.08}, motor_lag={"tau_s": 0.15})
    predictor = WheelPredictor(tracks_of(measured(true, seed=11)))
    others = set(all_effects()) - {"speed-gain", "wheelbase", "motor-lag", "camera-rotation"}
    search = StepwiseSelection(predictor, NOMINAL, barred=others)
    problem, fit = search._refit_with_noise(NOMINAL.with_effect("speed-gain", gain=0.95))
    ahead = search._forwards._looked_ahead(problem, fit, ("speed-gain",))
    assert {active.effect.name for active in ahead.effects} == {"speed-gain", "wheelbase", "motor-lag"}


@pytest.mark.parametrize("last", [True, False])
def test_a_sign_is_sought_beside_what_a_search_accepted_though_that_is_negligible(last):
    """A clock that is 10 ms late is taken and lowers no error; beside it, play in the gears earns nothing more."""
    near, none = SimpleNamespace(p_value=0.1, z=3.0, elpd_diff=1.0), SimpleNamespace(p_value=0.5, z=0.2, elpd_diff=0.0)
    candidate, nothing = (SimpleNamespace(name="backlash", rejected_because="", paired_comparison=e) for e in (near, none))
    rounds = [SelectionStep((one,), 0.5, "") for one in ((nothing, candidate) if last else (candidate, nothing))]
    problem = SimpleNamespace(predictor=SimpleNamespace(luck=None))
    found = SimpleNamespace(accepted=(), steps=tuple(rounds), nominal=SimpleNamespace(losses=np.full(12, 9.0)), problem=problem)
    assert (diagnosing._hint(found, 12, {"clock-offset"}) is candidate) is last
