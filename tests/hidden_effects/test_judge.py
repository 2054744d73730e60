"""The judge on canned answers, right and wrong."""

import numpy as np
import pytest

from tests.hidden_effects.__main__ import result_of
from tests.hidden_effects.acceptable import acceptable
from tests.hidden_effects.answer import read
from tests.hidden_effects.camera import Camera
from tests.hidden_effects.figure import confusion
from tests.hidden_effects.heldout import ratios
from tests.hidden_effects.judge import coverage, judge
from tests.hidden_effects.plan import QUICK, select, worlds
from tests.hidden_effects.summary import table
from tests.hidden_effects.world import World

GAIN = {"speed-gain": {"gain": 1.05}}
BASE = {"wheelbase": {"factor": 1.06}}
DELAY = {"command-delay": {"delay_s": 0.1}}


def canned(verdict, effects=(), ties=(), parameters=None):
    return {"verdict": verdict, "effects": list(effects), "ties": list(ties), "parameters": parameters or {}}


def outcome(hidden, given, **world):
    return judge(World("w", "single", hidden, **world), read(given))


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (canned("effects", ["speed-gain"]), "right"),
        (canned("effects", ["speed-gain", "motor-lag"]), "wrong"),
        (canned("effects", ["camera-scale"]), "wrong"),
        (canned("effects"), "wrong"),
        (canned("none"), "wrong"),
        (canned("unlisted", ["speed-gain"]), "wrong"),
        (canned("tie", [], [["speed-gain", "camera-scale"]]), "wrong"),
        (canned("insufficient-data"), "wrong"),
        ({}, "wrong"),
    ],
)
def test_one_effect(given, expected):
    assert outcome(GAIN, given) == expected


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (canned("tie", [], [["command-delay", "clock-offset"]]), "right"),
        (canned("tie", ["command-delay"], [["command-delay", "clock-offset"]]), "right"),
        (canned("tie", [], [["command-delay", "clock-offset", "motor-lag"]]), "wrong"),
        (canned("effects", ["command-delay"], [["command-delay", "clock-offset"]]), "wrong"),
        (canned("tie", ["wheelbase"], [["command-delay", "clock-offset"]]), "wrong"),
    ],
)
def test_a_tie_of_two(given, expected):
    assert outcome(DELAY, given) == expected


TWO_OF_THREE = [["speed-gain+wheelbase", "speed-gain+camera-scale", "camera-scale+wheelbase"]]


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (canned("tie", ["speed-gain", "wheelbase"], TWO_OF_THREE), "right"),
        (canned("tie", [], [TWO_OF_THREE[0][:2]]), "wrong"),
        (canned("tie", ["speed-gain"], [["wheelbase", "camera-scale"]]), "wrong"),
        (canned("effects", ["speed-gain", "wheelbase"]), "wrong"),
    ],
)
def test_a_tie_of_sets(given, expected):
    assert outcome(GAIN | BASE, given) == expected


def test_sets_that_are_listed_whole_are_taken_as_they_are():
    ties = [["camera-scale", "speed-gain", "wheelbase"]]
    sets = [name.split("+") for name in TWO_OF_THREE[0]]
    assert outcome(GAIN | BASE, canned("tie", sets[0], ties) | {"explanations": sets}) == "right"
    assert outcome(GAIN | BASE, canned("tie", sets[0], ties) | {"explanations": sets[:2]}) == "wrong"


def test_a_tie_beside_another_effect_can_be_told_in_two_ways():
    hidden = DELAY | {"side-slip": {"slip_s": 0.1}}
    assert outcome(hidden, canned("tie", ["side-slip"], [["command-delay", "clock-offset"]])) == "right"
    whole = [["command-delay+side-slip", "clock-offset+side-slip"]]
    assert outcome(hidden, canned("tie", [], whole)) == "right"
    assert outcome(hidden, canned("tie", [], [["command-delay", "clock-offset"]])) == "wrong"


def test_unlisted_and_none():
    unlisted = World("w", "unlisted", unlisted={"whirl": {}})
    assert judge(unlisted, read(canned("unlisted", ["battery-sag"]))) == "right"
    assert judge(unlisted, read(canned("effects", ["battery-sag"]))) == "wrong"
    assert judge(World("w", "none"), read(canned("none"))) == "right"
    assert judge(World("w", "none"), read(canned("unlisted"))) == "wrong"


def test_a_cause_that_is_on_the_list_by_now_is_to_be_named():
    unlisted = World("w", "unlisted", {"wheel-mismatch": {"share": 1.01}}, unlisted={"reverse-loss": {"loss": 0.1}})
    assert judge(unlisted, read(canned("effects", ["reverse-gain", "wheel-mismatch"]))) == "right"
    assert judge(unlisted, read(canned("effects", ["reverse-gain"]))) == "wrong"
    assert judge(unlisted, read(canned("unlisted", ["wheel-mismatch"]))) == "wrong"


def test_insufficient_data_abstains_under_hard_conditions_only():
    given = canned("insufficient-data")
    assert outcome(GAIN, given, trials=20) == "abstained"
    assert outcome(GAIN, given, camera=Camera(0.003, 0.009)) == "abstained"
    assert outcome(GAIN, given) == "wrong"


def reported(value, low, high):
    return {"speed-gain": {"gain": {"value": value, "low": low, "high": high}}}


def test_coverage_counts_intervals_that_hold_the_truth():
    world = World("w", "single", GAIN)
    inside = coverage(world, read(canned("effects", ["speed-gain"], parameters=reported(1.049, 1.04, 1.06))))
    outside = coverage(world, read(canned("effects", ["speed-gain"], parameters=reported(1.02, 1.01, 1.03))))
    without = coverage(world, read(canned("effects", ["speed-gain"], parameters={"speed-gain": {}})))
    assert [one.inside for one in (*inside, *outside, *without)] == [True, False, False]
    assert coverage(world, read(canned("effects", ["motor-lag"], parameters={"motor-lag": {}}))) == []


def test_a_model_with_the_true_value_is_as_good_as_the_truth_and_another_is_worse():
    world = World("w", "single", GAIN)
    true = ratios(world, read(canned("effects", ["speed-gain"], parameters=reported(1.05, 1, 2))))
    off = ratios(world, read(canned("effects", ["speed-gain"], parameters=reported(1.08, 1, 2))))
    np.testing.assert_allclose(list(true.values()), 1, rtol=1e-6)
    assert off["whole trial"] > 1.5
    assert ratios(world, read(canned("unlisted"))) is None


def test_models_that_are_tied_are_equally_good():
    world = World("w", "tie", {"wheelbase": {"factor": 0.94}, "camera-scale": {"factor": 1.05}})
    tied = reported(1.05, 1, 2) | {"wheelbase": {"factor": {"value": 0.94 * 1.05}}}
    found = ratios(world, read(canned("tie", ["speed-gain", "wheelbase"], TWO_OF_THREE, tied)))
    np.testing.assert_allclose(list(found.values()), 1, atol=1e-3)


def test_a_plan_answered_rightly_meets_every_target_and_wrongly_none(tmp_path):
    def told(world):
        right = acceptable(world)[0]
        sets = ["+".join(names) for names in right["required"]]
        given = canned(right["verdict"], right["required"][0] if sets else (), [sets] if len(sets) > 1 else ())
        return {"answer": given, "seconds_s": 1.0, "exit": 0, "error": ""}

    made = [world for world in select(worlds(0), "", True) if world.family != "none"]
    results = [result_of(world, told(world)) for world in made]
    assert {one.outcome for one in results} == {"right"}
    assert "NOT met" not in "\n".join(line for line in table(results).splitlines() if "error /" not in line)
    silent = [result_of(world, {"answer": None, "seconds_s": 1.0}) for world in made]
    assert table(silent).count("NOT met") == len({world.family for world in made}) - 1
    assert all(path.stat().st_size > 1000 for path in confusion(results, tmp_path / "confusion"))


def test_a_quick_look_takes_some_of_every_family():
    assert {world.family for world in select(worlds(0), "", True)} == set(QUICK)
    assert {world.family for world in select(worlds(0), "tie", False)} == {"tie"}
    assert select(worlds(0), "no such world", False) == []
