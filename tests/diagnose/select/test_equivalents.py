"""Two effects that do together what one does are named; others are not."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.design.competing_models import rivals_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import listed
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.report.text import diagnosis_text
from bns.diagnose.select import equivalents
from bns.diagnose.select.equivalents import equivalent_pairs
from bns.diagnose.values import ties_of
from bns.physics.effects import all_effects
from bns.physics.model import ActiveEffect
from tests.diagnose.worlds import NOMINAL, hidden, measured


def longer_than(model, names, nearly=None, **seen):
    predictor = WheelPredictor(tracks_of(measured(model, seed=5, **seen)))
    problem = problem_for(predictor, model)
    others = [effect for name, effect in listed(NOMINAL).items() if name not in names]
    return equivalent_pairs(problem, problem.fit(model), names, others, nearly)


@pytest.mark.parametrize(
    ("name", "value", "pair"),
    [
        ("speed_gain", {"gain": 1.05}, {"wheelbase", "camera-scale"}),
        ("wheelbase", {"factor": 0.95}, {"speed-gain", "camera-scale"}),
        ("camera_scale", {"factor": 0.94}, {"speed-gain", "wheelbase"}),
    ],
)
def test_any_of_gain_base_and_scale_is_both_others(name, value, pair):
    found = longer_than(hidden(**{name: value}), [name.replace("_", "-")])
    assert [set(names) for names in found] == [pair]


def test_beside_another_effect_that_one_stays():
    found = longer_than(hidden(speed_gain={"gain": 1.06}, motor_lag={"tau_s": 0.08}), ["speed-gain", "motor-lag"])
    assert [set(names) for names in found] == [{"wheelbase", "camera-scale", "motor-lag"}]


@pytest.mark.parametrize("name", ["motor_lag", "side_slip", "yaw_bias"])
def test_what_is_like_no_pair_has_none(name):
    values = {"motor_lag": {"tau_s": 0.09}, "side_slip": {"slip_s": 0.08}, "yaw_bias": {"rate_rad_s": 0.04}}
    assert longer_than(hidden(**{name: values[name]}), [name.replace("_", "-")]) == []


STRIBECK = {"width_m_s": 0.0082, "fade_m_s": 0.48}
QUIET = {"noise": (0.0004, 0.005), "jitter": 0.002, "commands": 8, "speeds": (0.02, 0.12)}
DEAD_ZONE = ActiveEffect(all_effects()["dead-zone"], (0.0082,))
GAIN = ActiveEffect(all_effects()["speed-gain"], (0.9,))


@pytest.mark.parametrize("nearly", [[DEAD_ZONE, GAIN], [DEAD_ZONE, DEAD_ZONE]])
def test_what_does_nearly_all_alone_is_completed(nearly):
    """A Stribeck friction that hardly fades is a dead zone and a gain; where the dead zone does nothing, nothing shows it."""
    model = hidden(stribeck=STRIBECK)
    assert longer_than(model, ["stribeck"], **QUIET) == []
    assert longer_than(model, ["stribeck"], {"stribeck": nearly}, **QUIET) == [("dead-zone", "speed-gain")]


@pytest.mark.parametrize(
    ("near", "left", "completed_by"),
    [
        (DEAD_ZONE, {"speed-gain": 0.29, "wheelbase": 0.31}, ["speed-gain"]),  # 0.03 of 0.1
        (DEAD_ZONE, {"speed-gain": 0.2, "wheelbase": 0.1, "side-slip": 0.29}, ["wheelbase", "speed-gain"]),
        (GAIN, {"wheelbase": 0.01}, []),  # it misses more than a tenth of the friction's gain itself
    ],
)
def test_only_what_does_most_of_the_rest_completes_what_does_nearly_all(monkeypatch, near, left, completed_by):
    class Spans:
        def __init__(self, *_):
            pass

        left = staticmethod(lambda name: left[name])

    model = hidden(stribeck=STRIBECK)
    problem = problem_for(WheelPredictor(tracks_of(measured(model, seed=5, **QUIET))), model)
    monkeypatch.setattr(equivalents, "_Spans", Spans)
    others = [listed(NOMINAL)[name] for name in left]
    found = equivalents._completed(problem, problem.fit(model), problem.fit(NOMINAL), near, others)
    assert [[effect.name for effect in pair] for pair, _ in found] == [[near.effect.name, name] for name in completed_by]
    assert all(near.effect.name in {a.effect.name for a in start.effects} for _, start in found)


def test_one_that_does_it_alone_is_no_pair():
    """It is a tie then, and the search has named it."""
    model = hidden(stribeck={"width_m_s": 0.0082, "fade_m_s": 5.0})
    assert longer_than(model, ["stribeck"], {"stribeck": [DEAD_ZONE]}) == []


@pytest.mark.slow
def test_two_effects_with_no_more_numbers_are_a_tie():
    """The one effect is no shorter an explanation: it has as many numbers."""
    table = measured(hidden(stribeck=STRIBECK), trials=24, seed=5, **QUIET)
    found = diagnose(WheelPredictor(tracks_of(table)), NOMINAL)
    assert (found.verdict, found.effects) == ("tie", ("stribeck",))
    answer = found.as_json()
    assert answer["ties"] == [["dead-zone+speed-gain", "stribeck"]]
    assert answer["explanations"] == [["stribeck"], ["dead-zone", "speed-gain"]]
    assert not any("with one more effect" in note for note in found.notes)
    (rival,) = rivals_of(found)
    assert rival.numbers["dead-zone"]["width_m_s"]["value"] == pytest.approx(0.0082, rel=0.05)
    assert "stribeck (or dead-zone+speed-gain)" in diagnosis_text(replace(found, verdict="unlisted"))


@pytest.mark.parametrize(
    ("others", "ties"),
    [
        ([], []),
        ([("b", "x")], [["a", "b"]]),
        ([("b", "c", "x")], [["a", "b+c"]]),
        ([("b", "x"), ("c", "d", "x")], [["a", "b", "c+d"]]),
        ([("b", "x"), ("a", "y"), ("a", "y", "z")], [["a", "b"], ["x", "y", "y+z"]]),
        ([("x",)], [["a"]]),
    ],
)
def test_what_stands_for_one_effect_together_is_one_of_its_group(others, ties):
    assert ties_of(SimpleNamespace(accepted=("a", "x"), competing_models=tuple(others))) == ties


@pytest.mark.parametrize(("names", "more"), [(("dead-zone", "speed-gain"), 0), (("dead-zone", "marker-offset"), 1), ((), -2)])
def test_numbers_are_counted_not_effects(monkeypatch, names, more):
    monkeypatch.setattr(equivalents, "known_effects", lambda _: all_effects())
    assert equivalents.more_numbers(SimpleNamespace(accepted=("stribeck",)), names) == more


@pytest.mark.slow
def test_a_diagnosis_says_so_in_a_note():
    table = measured(hidden(camera_scale={"factor": 0.95}), trials=16, seed=5)
    found = diagnose(WheelPredictor(tracks_of(table)), NOMINAL)
    assert found.effects == ("camera-scale",)
    assert any("would explain as much, with one more effect" in note and "wheelbase" in note for note in found.notes)


def test_of_more_pairs_than_are_fitted_those_that_span_most_are_taken(monkeypatch):
    model = hidden(speed_gain={"gain": 1.05})
    problem = problem_for(WheelPredictor(tracks_of(measured(model, trials=8, seed=5))), model)
    others = [listed(NOMINAL)[name] for name in ("side-slip", "yaw-bias", "wheelbase", "camera-scale")]
    monkeypatch.setattr(equivalents, "LEFT_OVER", 1.0)
    monkeypatch.setattr(equivalents, "TRIED", 3)
    found = equivalents._promising(problem, problem.fit(model), "speed-gain", others)
    assert len(found) == 3
    assert {effect.name for effect in found[0]} == {"wheelbase", "camera-scale"}


def test_sensitivities_are_asked_for_at_numbers_that_an_effect_may_have():
    """Where it does nothing, an effect may stand at its bound; then the only way is inwards."""
    asked = []
    base = SimpleNamespace(with_active=lambda _, values: values)
    problem = SimpleNamespace(whitened=lambda values: asked.append(values) or np.zeros((1, 3)))
    at_the_top = SimpleNamespace(neutral=1.0, low=0.0, high=1.0, plausible=(0.2, 1.0))
    inside = SimpleNamespace(neutral=0.0, low=-1.0, high=1.0, plausible=(-0.5, 0.5))
    own = SimpleNamespace(parameters=(at_the_top, inside), neutral={"one": 1.0, "other": 0.0})
    for effect in (own, *filter(equivalents._smooth, all_effects().values())):
        asked.clear()
        assert len(list(equivalents._columns(problem, base, np.zeros((1, 3)), np.ones((1, 1)), effect))) == len(asked)
        for values in asked:
            assert all(p.low <= value <= p.high for p, value in zip(effect.parameters, values, strict=True))
        neutral = tuple(effect.neutral.values())
        moved = [[i for i in range(len(neutral)) if values[i] != neutral[i]] for values in asked]
        assert moved == [[i] for i in range(len(neutral))]
