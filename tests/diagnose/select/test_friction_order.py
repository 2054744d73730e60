"""Friction behind a ramp, or before it: a search finds which, whichever of the two comes in first."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import fit_extended, fit_with
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.select.exchanges import Exchanges
from bns.diagnose.select.result import SelectionResult
from bns.diagnose.select.variants import order_of_friction
from bns.physics.effects import all_effects, effect_named
from tests.diagnose.worlds import NOMINAL, hidden, measured

DEAD_ZONE, LIMIT = {"dead_zone": {"width_m_s": 0.012}}, {"acceleration_limit": {"max_m_s2": 0.25}}
ORDERS = {"before": DEAD_ZONE | LIMIT, "behind": LIMIT | DEAD_ZONE}


@cache
def predictor_of(order):
    return WheelPredictor(tracks_of(measured(hidden(**ORDERS[order]), trials=20, seed=4, pauses=True)))


def names(model):
    return [active.effect.name for active in model.effects]


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("first", [0, 1])
def test_the_effect_that_comes_second_is_tried_on_either_side(order, first):
    problem = problem_for(predictor_of(order), NOMINAL)
    fit = problem.fit(NOMINAL)
    both = [effect_named("dead-zone"), effect_named("acceleration-limit")]
    for effect in (both[first], both[1 - first]):
        fit = fit_with(problem, fit, effect)
    assert names(fit.model) == [name.replace("_", "-") for name in ORDERS[order]]
    assert fit.loss < problem.fit(fit.model.with_friction_moved()).loss


def test_one_that_extends_another_is_tried_on_either_side():
    problem = problem_for(predictor_of("before"), NOMINAL)
    wrong = hidden(**ORDERS["behind"])
    fit = fit_extended(problem, problem.fit(wrong), effect_named("dead-zone-mismatch"))
    assert names(fit.model) == ["dead-zone-mismatch", "acceleration-limit"]


def test_one_that_takes_anothers_place_is_tried_on_either_side():
    """The friction that goes acts behind the ramp, the true one before it."""
    predictor = predictor_of("before")
    problem = problem_for(predictor, hidden(**ORDERS["before"]))
    fit = problem.fit(hidden(**LIMIT, stribeck={"width_m_s": 0.015, "fade_m_s": 0.1}))
    catalogue = {"dead-zone": effect_named("dead-zone")}
    found = Exchanges(predictor, catalogue, catalogue, lambda _: None).of(problem, fit, ("acceleration-limit", "stribeck"))
    (tried,) = (tried for gone, _, tried in found if gone == "stribeck")
    assert names(tried.model) == ["dead-zone", "acceleration-limit"]


def test_starts_from_tracks_see_the_wheels_behind_the_ramp():
    seen = []
    effect = replace(effect_named("breakaway"), starts_from=lambda wheels: seen.append(wheels.left_m_s) or ())
    predictor, ramp = predictor_of("behind"), hidden(**LIMIT)
    predictor.starts_of(effect, ramp)
    np.testing.assert_array_equal(seen[0], predictor.turned(ramp).left_m_s)
    assert (seen[0] != predictor.turned(NOMINAL).left_m_s).any()


@pytest.mark.slow
@pytest.mark.parametrize("order", ORDERS)
def test_a_diagnosis_names_both(order):
    others = set(all_effects()) - {"dead-zone", "acceleration-limit", "velocity-ramp", "stribeck", "motor-lag", "gear-friction"}
    found = diagnose(predictor_of(order), NOMINAL, barred=others)
    assert (found.verdict, names(found.selection.fit.model)) == ("effects", [name.replace("_", "-") for name in ORDERS[order]])
    assert any(note.startswith(f"dead-zone acts {order} acceleration-limit") for note in found.notes)
    parameters = found.as_json()["parameters"]
    assert parameters["dead-zone"]["width_m_s"]["value"] == pytest.approx(0.012, rel=0.05)
    assert parameters["acceleration-limit"]["max_m_s2"]["value"] == pytest.approx(0.25, rel=0.02)


@pytest.mark.parametrize(
    ("evidence", "said"),
    [
        (50.0, "For certain: held-out trials are predicted worse in the other order."),
        (5.0, "Held-out trials are 148 times as likely as in the other order, which is evidence, not proof."),
        (1.0, "Held-out trials do not tell this from the other order."),
        (-4.0, "Held-out trials do not tell this from the other order."),
    ],
)
def test_how_much_speaks_for_the_order_is_said(evidence, said):
    model = hidden(**ORDERS["behind"])
    fit = problem_for(predictor_of("behind"), model).fit(model)
    moved = replace(fit, held_out=fit.held_out + evidence / len(fit.held_out))
    found = SelectionResult(SimpleNamespace(fit=lambda _: moved), None, fit, ("dead-zone",), (), ())
    order = "dead-zone acts behind acceleration-limit: the order of effects in the model's file."
    assert order_of_friction(found) == f"{order} {said}"
    assert order_of_friction(replace(found, accepted=("speed-gain",))) == ""
    assert order_of_friction(replace(found, fit=replace(fit, model=NOMINAL))) == ""
