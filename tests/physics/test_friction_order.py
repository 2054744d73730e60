"""Friction before the ramps of a speed profile or behind them: the order, what keeps it, and the motion worked out by hand."""

import numpy as np
import pytest

from bns.physics.effects import effect_named
from bns.physics.model import Model, load_model
from bns.physics.order import FRICTION, ORDER, RAMPS
from bns.physics.wheels.differential_drive import simulate

BASE_M = 0.1
SPEED, LOST, LIMIT, LASTS_S = 0.2, 0.02, 0.4, 2.0


def names(model):
    return [active.effect.name for active in model.effects]


def active(model, name, *values):
    effect = effect_named(name)
    return model.with_active(effect, values or tuple(effect.neutral.values()))


@pytest.mark.parametrize("friction", FRICTION)
@pytest.mark.parametrize("ramp", RAMPS)
def test_friction_acts_behind_ramps_whichever_comes_first_and_moves(friction, ramp):
    for first, second in ((friction, ramp), (ramp, friction)):
        model = active(active(active(Model(BASE_M), first), second), "motor-lag")
        assert names(model) == [ramp, friction, "motor-lag"]
        moved = model.with_friction_moved()
        assert names(moved) == [friction, ramp, "motor-lag"]
        assert names(moved.with_friction_moved()) == names(model)


def test_without_a_ramp_friction_has_its_own_place():
    model = active(active(active(Model(BASE_M), "speed-limit"), "dead-zone"), "speed-gain")
    assert names(model) == sorted(names(model), key=ORDER.index) == ["speed-gain", "dead-zone", "speed-limit"]
    assert names(active(model, "acceleration-limit")) == ["speed-gain", "speed-limit", "acceleration-limit", "dead-zone"]


@pytest.mark.parametrize("last", [True, False])
def test_the_order_is_kept(last):
    model = active(active(Model(BASE_M), "acceleration-limit"), "dead-zone")
    model = model if last else model.with_friction_moved()
    assert model.is_friction_last == last
    assert active(model, "speed-gain").is_friction_last == last
    assert model.arranged() == model
    longer = active(model, "dead-zone-mismatch")
    assert (longer.is_friction_last, "dead-zone" in names(longer)) == (last, False)
    assert names(longer.without("dead-zone-mismatch")) == names(model)
    for gone in ("dead-zone", "acceleration-limit"):
        rest = model.without(gone)
        assert rest.with_friction_moved() is None
        assert names(active(rest, gone)) == names(model)
    assert names(active(model.without("dead-zone"), "stribeck")) == [n.replace("dead-zone", "stribeck") for n in names(model)]


@pytest.mark.parametrize("order", [("dead-zone", "acceleration-limit"), ("acceleration-limit", "dead-zone")])
def test_a_models_file_says_the_order(order, tmp_path):
    values = {"dead-zone": "{width_m_s: 0.01}", "acceleration-limit": "{max_m_s2: 0.3}"}
    entries = (f"  - {{name: {name}, values: {values[name]}, basis: guess, reason: a test}}\n" for name in order)
    (tmp_path / "robot.yaml").write_text(f"base: differential-drive\nwheelbase_m: 0.1\neffects:\n{''.join(entries)}")
    model = load_model(tmp_path / "robot.yaml")
    assert names(model.arranged()) == list(order)
    for gone in order:
        assert names(active(model.without(gone), gone)) == list(order)


@pytest.mark.parametrize("last", [True, False])
def test_the_way_from_rest(last):
    """Both end at u - d. Behind a ramp that takes place d/a later: the ramp has to reach u, not u - d."""
    model = active(active(Model(BASE_M), "acceleration-limit", LIMIT), "dead-zone", LOST)
    model = model if last else model.with_friction_moved()
    told = np.full((1, 1), SPEED)
    way_m = float(np.hypot(*simulate(model, told, told, np.full((1, 1), LASTS_S))[0, -1, :2]))
    until_s = (SPEED if last else SPEED - LOST) / LIMIT
    assert way_m == pytest.approx((SPEED - LOST) ** 2 / (2 * LIMIT) + (SPEED - LOST) * (LASTS_S - until_s), abs=2e-5)
