"""Effects stand only beside what describes the rest; what describes it is a term that can be added, in words of physics."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bns.api.diagnose import DiagnoseResult
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import listed
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.report.text import diagnosis_text
from bns.diagnose.residuals.earned_terms import left_over
from bns.diagnose.residuals.established import _step, established
from bns.diagnose.residuals.grammar import (
    CHANGES,
    CHANGES_ALONE,
    PAST,
    RESPONSE,
    RESPONSE_ALONE,
    RESPONSE_OF,
    SESSION,
    SLOWING,
    STRAIGHT,
    SURFACE,
    families,
    may_join,
)
from bns.diagnose.residuals.pruned import without_idle_terms, without_needless_terms
from bns.diagnose.residuals.ranked_families import ranked, rounding, significant
from bns.diagnose.residuals.restored import restored
from bns.diagnose.residuals.search_state import State
from bns.diagnose.residuals.symbolic import fitted, free_name
from bns.diagnose.residuals.words import in_words
from bns.physics.formula import formula_effect
from tests.diagnose.worlds import NOMINAL, all_but_rivals_of, hidden, measured

BOTH_WAYS = (-0.2, 0.2)
FOUND_TOGETHER = ("speed of each wheel", "wheels"), ("time in the trial", "share")


def predictor_of(model, **how):
    return WheelPredictor(tracks_of(measured(model, **{"trials": 20, "seed": 11} | how)))


def stands(predictor, *names):
    catalogue = listed(NOMINAL, None, predictor.tracks)
    return established(predictor, NOMINAL, {name: catalogue[name] for name in names})


def warming(share=-0.15, **effects):
    """A robot that is slower when a trial begins, by a rule that no list holds, and has listed effects as well."""
    return hidden(**effects).with_active(formula_effect("rough", "k * exp(-tau / 2)", "share"), (share,))


@pytest.mark.slow
def test_an_effect_that_is_there_stands_and_one_that_imitates_the_rest_does_not():
    predictor = predictor_of(warming(wheelbase={"factor": 1.06}))
    found = stands(predictor, "wheelbase", "speed-gain")
    assert found.names == ("wheelbase",)
    assert [term.signal for term in found.terms] == ["time in the trial"]
    low, high = found.fit.interval([f.effect for f in found.fit.free].index("wheelbase"))
    assert low < 1.06 < high


@pytest.mark.slow
def test_what_is_there_stands_where_nothing_is_left():
    predictor = predictor_of(hidden(wheelbase={"factor": 1.06}, speed_gain={"gain": 0.96}))
    found = stands(predictor, "speed-gain", "wheelbase")
    assert set(found.names) == {"speed-gain", "wheelbase"}
    assert found.terms == ()
    assert not left_over(found.problem, found.fit)


def test_a_curve_that_predicts_better_for_certain_comes_before_an_effect_that_imitates_it():
    predictor = predictor_of(warming())
    problem = problem_for(predictor, NOMINAL)
    left = {"speed-gain": listed(NOMINAL, None, predictor.tracks)["speed-gain"]}
    grammar = families(predictor, NOMINAL.wheelbase_m)
    following = _step(predictor, State(problem, problem.fit(NOMINAL)), left, grammar, 0.01, {})
    assert following.names == ()
    assert [term.signal for term in following.terms] == ["time in the trial"]


@pytest.mark.slow
def test_an_effect_that_keeps_little_of_its_gain_beside_the_term_is_out():
    predictor = predictor_of(hidden(backlash={"gap_m": 0.005}), speeds=BOTH_WAYS, commands=8, trials=30)
    found = stands(predictor, "motor-lag")
    assert found.names == ()
    assert found.terms[0].signal == "distance since each wheel reversed"
    lost_mm = float(re.fullmatch(r"a wheel loses ([\d.]+) mm .*", in_words(found.terms[0], predictor)).group(1))
    assert lost_mm == pytest.approx(5.0, rel=0.15)


@pytest.mark.slow
def test_a_diagnosis_lists_what_imitates_apart_and_offers_the_term_with_its_error():
    table = measured(warming(), trials=24, seed=3)
    barred = {"warm-up", *all_but_rivals_of("speed-gain", "motor-lag")}
    found = diagnose(WheelPredictor(tracks_of(table)), NOMINAL, barred=tuple(barred))
    answer = found.as_json()
    assert (answer["verdict"], answer["effects"], answer["parameters"]) == ("unlisted", [], {})
    assert answer["imitating"]
    assert re.match(r"slower by 1\d\.\d+% at 0 s of a trial", answer["terms"][0]["in_words"])
    assert answer["formula"]["term"] == answer["terms"][0]["term"]
    term = answer["terms"][0]
    assert found.model_with_terms.values_of(term["name"]) == term["values"]
    assert {name: number["value"] for name, number in term["parameters"].items()} == term["values"]
    assert f"{len(term['values'])} numbers; the formula is in the output of --json" in diagnosis_text(found)
    error = answer["error_with_terms"]["trial"]
    result = DiagnoseResult(None, found)
    assert result.errors_with_terms.loc["trial", "after"] == error["after"]
    assert result.errors.loc["trial", "after"] == answer["error"]["trial"]["after"] > error["after"]
    assert error["change_high"] < 0
    assert error["after"] < 0.6 * error["before"]


def test_no_knot_in_time_lies_behind_the_last_pose():
    predictor = predictor_of(NOMINAL, trials=6)
    functions = next(f for f in families(predictor, NOMINAL.wheelbase_m) if f.signal == "time in the trial").functions
    knots = {float(number) for text in functions for number in re.findall(r"\d+\.\d+", text)}
    assert max(knots) <= float(predictor.tracks.own_s.max()) + 1e-9
    assert max(knots) > 0.5 * float(predictor.tracks.own_s.max())


def test_steps_of_speed_are_found():
    predictor = predictor_of(hidden(command_quantisation={"step_m_s": 0.015, "share": 1.0}), trials=20)
    problem = problem_for(predictor, NOMINAL)
    family = rounding(problem, problem.fit(NOMINAL))
    assert float(family.functions[0].split(" ")[0].lstrip("(")) == pytest.approx(0.015, rel=5e-3)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_honest_robots_leave_nothing(seed):
    predictor = predictor_of(NOMINAL, seed=seed, speeds=BOTH_WAYS)
    problem = problem_for(predictor, NOMINAL)
    fit = problem.fit(NOMINAL)
    tried = families(predictor, NOMINAL.wheelbase_m)
    assert len(tried) > 10
    assert significant(ranked(problem, fit, [*tried, rounding(problem, fit)])) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("on", "term", "value", "signal", "says"),
    [
        ("left", "-k * sign(u)", 0.012, "speed of the left wheel", r"the left .* 0\.0199 m/s gives 0\.008\d* m/s \(-5\d\..*"),
        pytest.param(
            "wheels", "-k * min(u, 0)", 0.1, "speed of each wheel", r"a wheel's .* -0\.199 m/s gives -0\.179 m/s \(-10\.\d%\)",
        ),
        pytest.param(
            "left", "-k * u * max(u, 0)", 1.5, "speed of the left wheel, forwards and backwards",
            r"the left .* 0\.199 m/s gives 0\.1[34]\d* m/s \(-\d\d\.\d%\), -0\.199 m/s gives -0\.(199|2)\d* m/s \(.*%\)",
        ),
        pytest.param(
            "w", "-k * abs(v) * sin(heading - 1)", 0.5, "heading, in proportion to the speed",
            r"turning velocity at 0\.\d+ m/s depends on heading: \+\S+ °/s at a heading of -3\d°, -\S+ °/s at a heading of 14\d°",
        ),
        pytest.param(
            "right", "-k * max(fresh, 0)", 0.5, "changes of speed of the right wheel",
            r"just after a change of the right wheel's speed, \d\d% of it is missing, .*",
        ),
        ("v", "-k * abs(v) * cos(heading)", 0.06, "direction of travel",
         r"slower by [56]\.\d+% when it travels towards -?[0-5]°, faster by [56]\.\d+% .* -?1[78]\d°"),
        pytest.param(
            "w", "-k * moving * exp(-((x - 0.1)**2 + y**2) / 0.08)", 0.3, "place", "turning velocity depends on place .*",
        ),
    ],
)  # fmt: skip
def test_what_one_wheel_or_a_place_does_is_described(on, term, value, signal, says):
    robot = hidden().with_active(formula_effect("rough", term, on), (value,))
    predictor = predictor_of(robot, speeds=BOTH_WAYS, trials=24, commands=8)
    found = stands(predictor)
    assert [(one.signal, one.on) for one in found.terms] == [(signal, on)]
    assert re.fullmatch(says, in_words(found.terms[0], predictor))


@pytest.mark.slow
def test_beside_a_curve_no_effect_has_numbers_that_no_robot_has():
    """A robot that slides beyond a sideways acceleration: understeer is far beyond its range, and only bends the curve."""
    slides = formula_effect("grip", "w * (min(1, k / max(abs(v * w), 0.02)) - 1)", "w")
    robot = hidden().with_active(slides, (0.12,))
    predictor = predictor_of(robot, speeds=BOTH_WAYS, trials=24, commands=8)
    found = stands(predictor, "understeer")
    assert found.names == ()
    assert (found.terms[0].signal, found.terms[0].on) == ("speed with turn", "w")


@pytest.mark.slow
def test_a_patch_of_floor_keeps_its_numbers_where_it_is_weighed_against_effects():
    """Its formula cannot be calculated at 0, where other terms begin."""
    patch = {"x_m": 0.1, "y_m": -0.05, "radius_m": 0.25, "loss": 0.5}
    predictor = predictor_of(hidden(floor_patch=patch), trials=40, commands=8)
    found = stands(predictor, "speed-gain")
    assert found.names == ()
    said = r"slower by (4|5)\d\.\d+% within 0\.2[3-7]\d* m of \(0\.[01]\d*, -0\.0\d*\) m"
    assert re.match(said, in_words(found.terms[0], predictor))


@pytest.mark.slow
def test_a_patch_that_slows_forward_motion_alone_is_described():
    """Turns there are as commanded: a share of all motion does not describe it."""
    patch = formula_effect("patch", "-0.4 * v / (1 + (((x - 0.1)**2 + (y + 0.05)**2) / 0.2**2)**8) * k", "v")
    predictor = predictor_of(NOMINAL.with_active(patch, (1.0,)), trials=40, commands=8)
    found = stands(predictor)
    assert [(term.signal, term.on) for term in found.terms] == [("place", "v")]
    said = r"slower by (3|4)\d\.\d+% in forward motion within 0\.(19|2)\d* m of \(0\.(09|1)\d*, -0\.0\d*\) m"
    assert re.match(said, in_words(found.terms[0], predictor))


def test_a_slope_on_which_wheels_do_not_slip_sideways_is_described():
    """The listed slope drifts downhill whatever the heading; wheels that hold only lose or gain forward speed."""
    slope = formula_effect("slope", "k * moving * cos(heading - 0.8)", "v")
    predictor = predictor_of(NOMINAL.with_active(slope, (-0.02,)))
    found = stands(predictor)
    assert [(term.signal, term.on) for term in found.terms] == [("heading", "v")]
    assert not left_over(found.problem, found.fit)


def test_a_floor_that_slows_turns_as_well_in_one_direction_is_described():
    """A carpet's nap: forward motion alone does not describe it."""
    nap = formula_effect("nap", "k * cos(heading - 0.6)", "share")
    predictor = predictor_of(NOMINAL.with_active(nap, (-0.12,)))
    found = stands(predictor)
    assert [(term.signal, term.on) for term in found.terms] == [("heading", "share")]
    said = in_words(found.terms[0], predictor)
    slower, at = map(float, re.match(r"slower by ([\d.]+)% at a heading of (-?\d+)°, faster by ", said).groups())
    assert slower == pytest.approx(12.0, abs=1.0)
    assert at == pytest.approx(np.degrees(0.6), abs=8)
    assert not left_over(found.problem, found.fit)


def drawn_by_curves(predictor, *wanted):
    """A search that ended in terms of these families (signal, on), where no effect came in."""
    problem = problem_for(predictor, NOMINAL)
    state = State(problem, problem.fit(NOMINAL))
    for number, one in enumerate(wanted, 1):
        family = next(f for f in families(predictor, NOMINAL.wheelbase_m) if (f.signal, f.on) == one)
        term = fitted(state.problem, state.fit, one[1], family.term, f"term-{number}", one[0])
        state = replace(state.settled(predictor, term.fit), terms=(*state.terms, term))
    return state


def test_an_effect_that_does_what_a_curve_does_stands_in_its_place():
    predictor = predictor_of(hidden(dead_zone={"width_m_s": 0.02}))
    catalogue = listed(NOMINAL, None, predictor.tracks)
    state = drawn_by_curves(predictor, ("speed of each wheel", "wheels"))
    ended = restored(predictor, state, {name: catalogue[name] for name in ("wheelbase", "dead-zone")}, 0.01)
    assert (ended.names, ended.terms) == (("dead-zone",), ())
    assert ended.fit.values.tolist() == pytest.approx([0.02], abs=3e-4)
    assert restored(predictor, state, {"wheelbase": catalogue["wheelbase"]}, 0.01) is state


def test_several_effects_that_draw_one_curve_together_do_not():
    """A dead zone of one wheel: one of both, with wheels that differ, does most of it."""
    one_sided = formula_effect("left", "-k * sign(u) * min(abs(u), 0.01)", "left")
    predictor = predictor_of(NOMINAL.with_active(one_sided, (1.0,)), speeds=(0.05, 0.2))
    catalogue = listed(NOMINAL, None, predictor.tracks)
    state = drawn_by_curves(predictor, ("speed of the left wheel", "left"))
    both = {name: catalogue[name] for name in ("wheel-mismatch", "dead-zone")}
    assert restored(predictor, state, both, 0.01) is state


def test_an_effect_that_leaves_metres_behind_does_not_stand_in_place_of_a_curve():
    """A strong warm-up beside slow wheels: the gain has nearly all of the likelihood, and too little of the error in metres."""
    predictor = predictor_of(warming(-0.4, speed_gain={"gain": 0.8}))
    catalogue = listed(NOMINAL, None, predictor.tracks)
    state = drawn_by_curves(predictor, ("time in the trial", "share"))
    assert restored(predictor, state, {"speed-gain": catalogue["speed-gain"]}, 0.01) is state


@pytest.mark.parametrize("warm_up", [-0.05, -0.2])
def test_an_effect_stands_in_place_of_its_curve_beside_another_curve_that_stays(warm_up):
    predictor = predictor_of(warming(warm_up, dead_zone={"width_m_s": 0.02}))
    catalogue = listed(NOMINAL, None, predictor.tracks)
    state = drawn_by_curves(predictor, *FOUND_TOGETHER)
    ended = restored(predictor, state, {"dead-zone": catalogue["dead-zone"]}, 0.01)
    assert (ended.names, [term.signal for term in ended.terms]) == (("dead-zone",), ["time in the trial"])
    low, high = ended.fit.interval([f.effect for f in ended.fit.free].index("dead-zone"))
    assert low < 0.02 < high


def test_a_curve_that_can_draw_an_effect_does_not_come_back_beside_it():
    """The curve still earns something, the rest that it cannot draw well; the effect would earn nothing beside it."""
    predictor = predictor_of(warming(-0.05, dead_zone={"width_m_s": 0.02}))
    catalogue = listed(NOMINAL, None, predictor.tracks)
    state = drawn_by_curves(predictor, ("speed of each wheel", "wheels"))
    ended = restored(predictor, state, {"dead-zone": catalogue["dead-zone"]}, 0.01)
    assert (ended.names, ended.terms) == (("dead-zone",), ())


@pytest.mark.parametrize("effects_leave_something", [False, True])
def test_effects_that_leave_something_do_not_replace_a_curve_that_leaves_nothing(monkeypatch, effects_leave_something):
    """A dead zone explains its curve; only what is left beside each of them is mocked."""
    predictor = predictor_of(hidden(dead_zone={"width_m_s": 0.02}))
    state = drawn_by_curves(predictor, ("speed of each wheel", "wheels"))

    def leaves_something(_, fit):
        return effects_leave_something and "term-1" not in {active.effect.name for active in fit.model.effects}

    monkeypatch.setattr("bns.diagnose.residuals.pruned._leaves_something", leaves_something)
    accepted = {"dead-zone": listed(NOMINAL, None, predictor.tracks)["dead-zone"]}
    ended = without_needless_terms(predictor, state, accepted, 0.01)
    assert (ended.names, ended.terms == state.terms) == (((), True) if effects_leave_something else (("dead-zone",), False))


def test_a_share_of_motion_over_speed_and_turn_contains_a_share_of_all_motion():
    """Else a gain beside it would be the number of the one corner that it lacks: slow motion."""
    predictor = predictor_of(hidden())
    surface = next(f for f in families(predictor, NOMINAL.wheelbase_m) if (f.signal, f.on) == (SURFACE, "share"))
    term = formula_effect("surface", surface.term, "share")
    all_alike = NOMINAL.with_active(term, tuple(-0.1 for _ in term.parameters))
    gain = NOMINAL.with_active(listed(NOMINAL, None, predictor.tracks)["speed-gain"], (0.9,))
    np.testing.assert_allclose(predictor.steps(all_alike).body, predictor.steps(gain).body, atol=1e-5)


def test_a_term_that_is_idle_beside_later_ones_goes(monkeypatch):
    """Also where a step that leaves one trial out overshoots, so that held-out trials seem to gain by it."""
    predictor = predictor_of(warming(-0.2))
    state = drawn_by_curves(predictor, ("time in the trial", "share"), ("speed and turn", "s"))
    ended = without_idle_terms(predictor, state, 0.01)
    assert [term.name for term in ended.terms] == ["term-1"]
    assert without_idle_terms(predictor, ended, 0.01) is ended
    certain = SimpleNamespace(elpd_diff=20.0, dse=2.0, p_value=1e-5, z=10.0)
    monkeypatch.setattr("bns.diagnose.estimate.fitting.Problem.paired_comparison", lambda *_: certain)
    assert [term.name for term in without_idle_terms(predictor, state, 0.01).terms] == ["term-1"]
    both = drawn_by_curves(predictor_of(warming(-0.2, dead_zone={"width_m_s": 0.02})), *FOUND_TOGETHER)
    assert without_idle_terms(both.problem.predictor, both, 0.01) is both


@pytest.mark.parametrize(
    ("term", "said"),
    [("-0.05 * u", "a wheel is slower by 5.00% than its command at all speeds"), ("-0.5 * u * abs(u)", "not proportional")],
)
def test_a_wheel_that_is_slower_by_one_share_is_not_called_out_of_proportion(term, said):
    fit = SimpleNamespace(model=NOMINAL)
    stand_in = SimpleNamespace(on="wheels", term=term, values={}, signal="speed of each wheel", fit=fit)
    assert said in in_words(stand_in, predictor_of(NOMINAL))


@pytest.mark.parametrize(
    ("on", "signal", "fastest"),
    [
        ("left", "speed of the left wheel", 0.02),
        ("right", "speed of the right wheel", 0.12),
        ("wheels", "speed of each wheel", 0.12),
    ],
)
def test_of_one_wheels_curve_only_what_this_wheel_drove_is_said(on, signal, fastest):
    """Beyond that the curve says nothing: the left wheel never turned faster than 0.02 m/s."""
    table = measured(NOMINAL, trials=12, speeds=(0.0, 0.12))
    predictor = WheelPredictor(tracks_of(table.assign(left_m_s=table["left_m_s"] / 6)))
    fit = SimpleNamespace(model=NOMINAL)
    words = in_words(SimpleNamespace(on=on, term="-0.5 * u * abs(u)", values={}, signal=signal, fit=fit), predictor)
    told = [float(text) for text in re.findall(r"([\d.e-]+) m/s gives", words)]
    assert max(told) == pytest.approx(fastest, rel=0.05)


def test_where_the_floor_brakes_is_said():
    predictor = predictor_of(NOMINAL)
    term = "-0.1 * exp(-((x - 0.2)**2 + (y + 0.1)**2) / 0.02)"
    words = in_words(SimpleNamespace(on="share", term=term, values={}, signal="place"), predictor)
    found = re.match(r"the robot is slower by ([\d.]+)% near \(([-\d.]+), ([-\d.]+)\) m, ", words)
    assert [float(text) for text in found.groups()] == pytest.approx([10.0, 0.2, -0.1], abs=0.05)
    moving = in_words(SimpleNamespace(on="v", term=f"v * {term}", values={}, signal="forward speed at a place"), predictor)
    assert moving.startswith("the robot is in forward motion slower by ")


@pytest.mark.parametrize(
    ("on", "term", "said"),
    [
        ("v", "0.004 * moving * cos(heading - 0.8) + 0 * v", "+4 mm/s at a heading of 46°, -4 mm/s at a heading of -134°"),
        ("w", "0.02 * moving * sin(heading)", "+1.1 °/s at a heading of 90°, -1.1 °/s at a heading of -90°"),
    ],
)
def test_where_a_slope_helps_and_where_it_brakes_is_said(on, term, said):
    stand_in = SimpleNamespace(on=on, term=term, values={}, signal="heading")
    assert in_words(stand_in, predictor_of(NOMINAL)).endswith(said)


def surface(term, on):
    stand_in = SimpleNamespace(on=on, term=term, values={}, signal=SURFACE, fit=SimpleNamespace(model=NOMINAL))
    return in_words(stand_in, predictor_of(NOMINAL))


def test_a_loss_of_turning_that_is_alike_everywhere_is_said_in_one_number():
    assert surface("-0.12 * sign(w)", "w") == "the robot turns slower by 6.9 °/s, at nearly all speeds and turn rates alike"
    assert surface("-0.12 * sign(w)", "w") != surface("-0.06 * sign(w)", "w")
    assert surface("0.02 * sign(v)", "v") == "the robot drives faster by 20 mm/s, at nearly all speeds and turn rates alike"
    assert surface("-0.1 + 0 * v", "share").startswith("the robot is slower by 10.00%, at nearly all")


def test_of_a_loss_that_grows_its_ends_are_said():
    at = r" °/s at \S+ m/s with -?\d+ °/s"
    said = re.fullmatch(rf"the robot turns slower by ([\d.]+){at}, slower by ([\d.]+){at}", surface("-0.3 * w", "w"))
    most, least = (float(text) for text in said.groups())
    assert most > 2 * least > 0


def test_a_formula_without_a_signal_says_what_it_is_a_function_of():
    fit = SimpleNamespace(model=NOMINAL)
    stand_in = SimpleNamespace(on="w", term="k0 * v * x + k1 * v * y", values={"k0": 2.0, "k1": 1.0}, signal="", fit=fit)
    words = in_words(stand_in, predictor_of(NOMINAL))
    assert re.fullmatch(r"turning velocity depends on forward velocity and place \(by up to [\d.]+ °/s\)", words)
    spinning = SimpleNamespace(on="w", term="k * moving", values={"k": np.radians(2.5)}, signal="", fit=fit)
    assert in_words(spinning, predictor_of(NOMINAL)) == "turning velocity depends on whether a wheel turns (by up to 2.5 °/s)"


@pytest.mark.parametrize(
    ("on", "said"),
    [
        ("share", "slower by 20.00% within 0.3 m of"),
        ("v", "slower by 20.00% in forward motion within 0.3 m of"),
        ("w", "slower by 20.00% in its turns within 0.3 m of"),
        ("s", "the robot slides to the left by 20.00% of its speed within 0.3 m of"),
        ("east", "velocity east differs by -200 mm/s within 0.3 m of"),
    ],
)
def test_what_a_patch_of_floor_does_is_said_of_the_velocity_that_it_changes(on, said):
    patch = SimpleNamespace(on=on, term="", values={"k": -0.2, "a": 0.1, "b": 0.2, "c": -0.3}, signal="place")
    assert in_words(patch, None) == f"{said} (0.1, 0.2) m"


@pytest.mark.slow
def test_a_formula_that_is_no_part_of_the_model_is_called_a_hint():
    predictor = predictor_of(NOMINAL)
    found, problem = diagnose(predictor, NOMINAL), problem_for(predictor, NOMINAL)
    hint = fitted(problem, problem.fit(NOMINAL), "v", "k * v", "drag")
    text = diagnosis_text(replace(found, formula=hint))
    assert "hint, not part of the extended model: candidate term drag, added to v: k * v" in text
    assert "bns add LOG drag --term 'k * v' --on v --model MODEL -o NEW.yaml" in text


@pytest.mark.parametrize(("waves", "shown"), [(1, True), pytest.param(9, False, marks=pytest.mark.slow)])
def test_a_long_formula_is_said_where_it_is_and_not_shown(waves, shown):
    predictor = predictor_of(NOMINAL)
    found, problem = diagnose(predictor, NOMINAL), problem_for(predictor, NOMINAL)
    term = " + ".join(f"k{i} * sin({i} * heading)" for i in range(1, waves + 1))
    waving = fitted(problem, problem.fit(NOMINAL), "w", term, "unlisted", "heading")
    text = diagnosis_text(replace(found, verdict="unlisted", terms=(waving,), terms_in_words=("it waves",)))
    assert "It behaves like this: it waves." in text
    assert (term in text) == ("unlisted: k1 = " in text) == shown
    assert shown or "unlisted (heading), added to w: 9 numbers; the formula is in the output of --json and in" in text


def test_a_family_earns_the_same_beside_a_term_of_any_name():
    """A term of the model had the name of the additions that are tried, and went while they were."""
    predictor = predictor_of(warming(-0.2, wheelbase={"factor": 1.1}))
    family = next(f for f in families(predictor, NOMINAL.wheelbase_m) if (f.signal, f.on) == ("speed and turn", "w"))
    problem = problem_for(predictor, NOMINAL)
    fits = [fitted(problem, problem.fit(NOMINAL), "share", "k * exp(-tau / 2)", name).fit for name in ("unlisted", "any")]
    one, other = (ranked(problem, fit, [family])[0].paired_comparison for fit in fits)
    assert one == other
    assert one.elpd_diff > 0.0


def test_a_model_that_was_extended_before_keeps_its_term():
    predictor = predictor_of(warming(-0.2))
    problem = problem_for(predictor, NOMINAL)
    before = fitted(problem, problem.fit(NOMINAL), "w", "k * moving * cos(heading)").fit.model
    found = established(predictor, before, {})
    assert [term.name for term in found.terms] == ["unlisted-2"]
    assert {a.effect.name for a in found.fit.model.effects} == {"unlisted", "unlisted-2"}
    assert free_name(found.fit.model) == "unlisted-3"


def test_of_answers_to_past_commands_only_one_is_a_term():
    predictor = predictor_of(NOMINAL)
    every = families(predictor, NOMINAL.wheelbase_m)
    past = [f for f in every if f.signal in PAST]
    of_one = [signal for each in (RESPONSE_OF, RESPONSE_ALONE, CHANGES_ALONE) for signal in each.values()]
    assert {f.signal for f in past} == {RESPONSE, SLOWING, CHANGES, *of_one}
    assert len(past) == 9
    assert all(may_join([(f.signal, f.on)], past) == [] for f in past)
    assert len(may_join([], every)) == len(every)
    assert len(may_join([(CHANGES, "wheels")], every)) == len(every) - len(past)
    assert len(may_join([("heading", "v")], every)) == len(every) - 1


@pytest.mark.slow
def test_a_heading_that_drifts_on_straight_lines_alone_is_described():
    """A gyro with a bias holds the heading, and only while both wheels are told the same."""
    held = formula_effect("held", "k * moving * max(1 - abs(w) / 0.05, 0)", "w")
    table = measured(NOMINAL.with_active(held, (0.03,)), trials=30, seed=11, commands=8, speeds=BOTH_WAYS, straight=0.5)
    predictor = WheelPredictor(tracks_of(table))
    found = established(predictor, NOMINAL, {"yaw-bias": listed(NOMINAL, None, predictor.tracks)["yaw-bias"]})
    assert (found.names, [term.signal for term in found.terms]) == ((), [STRAIGHT])
    rates = re.findall(r"\+([\d.]+) °/s at", in_words(found.terms[0], predictor))
    assert [float(rate) for rate in rates] == pytest.approx([np.degrees(0.03)] * 2, rel=0.15)
    straight_never = predictor_of(NOMINAL)
    assert STRAIGHT not in {f.signal for f in families(straight_never, NOMINAL.wheelbase_m)}


@pytest.mark.slow
def test_what_changes_in_the_middle_of_a_session_is_described():
    """A load was moved: one wheel has been slower since then. A voltage that sags over the session would imitate it."""
    slow = NOMINAL.with_active(formula_effect("slow", "-k * u", "left"), (0.03,))
    parts = [measured(robot, trials=20, seed=seed, speeds=BOTH_WAYS) for seed, robot in enumerate((NOMINAL, slow))]
    table = pd.concat([parts[0], parts[1].assign(trial=parts[1]["trial"] + 20)], ignore_index=True)
    table["session_s"] = table["t_s"] + 7.5 * table["trial"]
    predictor = WheelPredictor(tracks_of(table))
    assert predictor.tracks.start_known
    catalogue = listed(NOMINAL, None, predictor.tracks)
    found = established(predictor, NOMINAL, {name: catalogue[name] for name in ("battery-sag", "wheel-mismatch")})
    assert [(term.signal, term.on) for term in found.terms] == [(SESSION, "left")]
    assert found.names == ()
    said = in_words(found.terms[0], predictor)
    slower, at_s = re.fullmatch(r"the left wheel is slower by ([\d.]+)% at (\d+) s of the session.*", said).groups()
    assert float(slower) == pytest.approx(3.0, rel=0.25)
    assert float(at_s) > 150
