"""Servos that turn too slowly: found where set points jump, and the same speed on a log whose set points move otherwise."""

from types import SimpleNamespace

import pytest
import yaml

import bns
from bns.diagnose.effect_caveats import on_servo_speed
from bns.physics.jointed.mechanism import machine
from bns.physics.jointed.model_files import load_body
from tests.jointed.arm import log, xml

SPEED_RAD_S = 1.5


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    place = tmp_path_factory.mktemp("arm")
    (place / "arm.xml").write_text(xml())
    log(8, seed=1, speed_rad_s=SPEED_RAD_S).to_csv(place / "jumps.csv", index=False)
    log(8, seed=2, speed_rad_s=SPEED_RAD_S, told_rad_s=2.5).to_csv(place / "ramps.csv", index=False)
    return place


@pytest.fixture(scope="module")
def found(place):
    return bns.add(place / "jumps.csv", ["servo-speed-limit"], model=bns.Model(place / "arm.xml"))


def test_the_speed_is_that_of_the_servos(found, place):
    path = found.model.save(place / "slow.yaml")
    tree = yaml.safe_load(path.read_text())
    share = tree["effects"][0]["values"]["share"]
    assert 0.15 < share < 0.6
    assert share * tree["fastest_set_point_rad_s"] == pytest.approx(SPEED_RAD_S, rel=0.02)


def test_it_is_the_same_speed_where_set_points_move_otherwise(found, place):
    path = found.model.save(place / "slow.yaml")
    compared = bns.compare(place / "ramps.csv", model=bns.Model(place / "arm.xml"), beside=[path])
    given_m, slow_m = compared.errors.position_m["stretch"], compared.changes.position_m.iloc[0]
    assert slow_m < 0.4 * given_m


def test_a_model_knows_what_its_limit_is_a_share_of(place):
    arm = load_body(str(place / "arm.xml"))
    slow = arm.with_effect("servo-speed-limit", share=0.5)
    assert not arm.limited_by_set_points
    assert slow.limited_by_set_points
    assert not slow.by_set_points(3.0).limited_by_set_points
    assert slow.by_set_points(3.0).mechanism.sha256 not in {slow.mechanism.sha256, slow.by_set_points(4.0).mechanism.sha256}
    snake = load_body("snake").with_effect("servo-speed-limit", share=0.5)
    assert not snake.limited_by_set_points  # all its servos are told to move at one speed
    assert machine(snake.mechanism).mechanism.joint_speed_rad_s > 0


@pytest.mark.parametrize(("accepted", "said"), [(("servo-speed-limit",), 1), (("dead-band",), 0)])
def test_the_speed_is_said_in_radians_per_second(monkeypatch, accepted, said):
    monkeypatch.setattr("bns.diagnose.effect_caveats.JointedPredictor", SimpleNamespace)
    model = load_body("snake").with_effect("servo-speed-limit", share=0.25)
    problem, fit = SimpleNamespace(predictor=SimpleNamespace(told_rad_s=6.4)), SimpleNamespace(model=model)
    notes = list(on_servo_speed(SimpleNamespace(accepted=accepted, problem=problem, fit=fit)))
    assert len(notes) == said
    assert all("up to 6.4 rad/s" in note and "turn at up to 1.6 rad/s" in note for note in notes)
