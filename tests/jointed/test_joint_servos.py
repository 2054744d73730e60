"""Dry friction in joints and servos of a lower gain: as MuJoCo alone has them, and named where they are hidden."""

from types import SimpleNamespace

import numpy as np
import pytest

import bns
from bns.diagnose.predict import stretches
from bns.diagnose.select.extending import variant
from bns.physics.jointed.drives import Drive
from bns.physics.jointed.mechanism import Mechanism, machine
from bns.physics.jointed.model_files import load_body
from bns.physics.jointed.simulate import Simulator
from tests.hidden_snake.body import GEAR_LOSS, LIMIT, STIFFNESS, Hidden, Snake
from tests.jointed.arm import JOINTS, log, xml
from tests.jointed.test_damped_servos import body, driven_by_mujoco, set_points

SNAKE = load_body("snake")
HELD_RAD = 0.06


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.xml").write_text(xml())
    return bns.Model(tmp_path / "arm.xml")


def moved(text, name, **values):
    """Elbow and hand (steps, 2, 2) of the arm of that file with an effect, from where its first set point is."""
    m = machine(Mechanism(text, ("elbow", "hand")))
    effect = catalogue(text)[name]
    plant, told = effect.apply(m.plant, **values), set_points()
    simulator = Simulator(m, [Drive(told, np.arange(len(told)), np.zeros(3))], 1)
    return simulator.sightings(plant, simulator.at_rest()).point_m


def catalogue(text):
    """Effects of the arm of that file."""
    mechanism = Mechanism(text, ("elbow", "hand"))
    return SNAKE.__class__(name="arm", mechanism=mechanism).catalogue()


def rubbing(text, *joints):
    """The file with dry friction in those joints, of which the servos have 6 N m/rad."""
    for joint in joints:
        text = text.replace(f'<joint name="{joint}"', f'<joint name="{joint}" frictionloss="{6.0 * HELD_RAD}"')
    return text


@pytest.mark.parametrize(("integrator", "damping"), [("RK4", 0.4), ("implicitfast", 0.0), ("Euler", 0.0)])
@pytest.mark.parametrize(("name", "joints"), [("dry-friction", JOINTS), ("joint-friction-elbow", ("elbow",))])
def test_friction_is_that_of_a_file_that_has_it(integrator, damping, name, joints):
    text = body(integrator, damping)
    there, sound = driven_by_mujoco(rubbing(text, *joints)), driven_by_mujoco(text)
    assert np.abs(there - sound).max() > 0.01
    np.testing.assert_allclose(moved(text, name, held_rad=HELD_RAD), there, atol=1e-6)


@pytest.mark.parametrize(("integrator", "damping"), [("RK4", 0.4), ("implicitfast", 0.4), ("implicitfast", 0.0), ("Euler", 0.0)])
def test_a_soft_joint_is_that_of_a_file_with_a_lower_gain_and_the_same_limit(integrator, damping):
    text = body(integrator, damping)
    servo = '<position joint="elbow"' + text.split('<position joint="elbow"')[1].split("/>")[0]
    soft = servo.replace('kp="6.0"', 'kp="3.0"').replace(f'kv="{damping}"', f'kv="{damping / 2}"')
    there = driven_by_mujoco(text.replace(servo, soft))
    weak = moved(text, "weak-joint-elbow", strength=0.5)
    np.testing.assert_allclose(moved(text, "soft-joint-elbow", strength=0.5), there, atol=1e-6)
    assert np.abs(weak - there).max() > 0.02  # the limit is felt


def test_friction_of_a_model_can_be_taken_away_but_there_is_none_below_none():
    m = machine(SNAKE.mechanism)
    own = m.model.dof_frictionloss[6:]
    assert (own > 0).all()

    def with_friction(held_rad):
        return m.changed(SNAKE.effect_named("dry-friction").apply(m.plant, held_rad=held_rad)).dof_frictionloss

    assert with_friction(0.02)[6:] == pytest.approx(own + 0.02 * m.stiffness_n_m_rad)
    assert with_friction(-0.005)[6:] == pytest.approx(own - 0.005 * m.stiffness_n_m_rad)
    assert not with_friction(-0.05).any()
    assert not with_friction(0.02)[:6].any()  # the root is no joint
    one = m.changed(SNAKE.effect_named("joint-friction-joint3").apply(m.plant, held_rad=0.1)).dof_frictionloss[6:]
    at = m.joints.index("joint3")
    assert one[at] == pytest.approx(own[at] + 0.1 * m.stiffness_n_m_rad[at])
    assert np.delete(one, at) == pytest.approx(np.delete(own, at))


def test_friction_stops_a_joint_short_of_where_its_servo_brings_it():
    m, goal = machine(Mechanism(xml(), ("hand",))), np.array([[0.5, -0.4, 0.0]])
    simulator = Simulator(m, [Drive(goal, np.array([0]), np.zeros(3))], 1)
    rubs = catalogue(xml())["joint-friction-elbow"].apply(m.plant, held_rad=0.1)
    assert simulator._put_down(m.plant)[0, 1:4] == pytest.approx(goal[0])
    assert simulator._put_down(rubs)[0, 1:4] == pytest.approx([0.5, -0.3, 0.0])
    jammed = catalogue(xml())["joint-friction-elbow"].apply(m.plant, held_rad=1.0)
    assert simulator._put_down(jammed)[0, 1:4] == pytest.approx([0.5, 0.0, 0.0])


@pytest.mark.parametrize(
    ("name", "settles"), [("joint-friction-elbow", True), ("soft-joint-elbow", True), ("servo-delay", False)]
)
def test_a_joint_that_does_not_reach_its_first_posture_begins_where_it_stays(monkeypatch, name, settles):
    m, asked = machine(Mechanism(xml(), ("hand",))), []
    simulator = SimpleNamespace(
        machine=m,
        only=lambda chosen: simulator,
        settled=asked.append,
        sightings=lambda plant, rest: None,
    )
    monkeypatch.setattr(stretches, "replace_state", lambda rest, state: rest)
    monkeypatch.setattr(stretches, "_stacked", lambda sighting: sighting)
    simulations = SimpleNamespace(simulator=simulator, _rest=lambda chosen: None)
    effect = catalogue(xml())[name]
    plant = effect.apply(m.plant, **{p.name: p.part_way(0.5, p.neutral < p.high) for p in effect.parameters})
    owner = next(kind for kind in vars(stretches).values() if hasattr(kind, "_all_simulated"))
    owner._all_simulated(simulations, plant, np.array([0]))
    assert bool(asked) is settles


def test_a_soft_joint_takes_the_place_of_a_weak_one_and_is_none_where_torque_has_no_limit():
    known = catalogue(xml())
    assert known["soft-joint-elbow"].extends == "weak-joint-elbow"
    assert variant(known, "soft-joint-elbow")
    unlimited = xml().replace('joint="elbow" kp="6.0" forcerange="-3 3"', 'joint="elbow" kp="6.0"')
    soft = [name for name in catalogue(unlimited) if name.startswith("soft-joint-")]
    assert soft == ["soft-joint-shoulder", "soft-joint-wrist"]
    assert "weak-joint-elbow" in catalogue(unlimited)


def test_the_second_snake_rubs_and_yields_as_it_is_told():
    snake = Snake(Hidden(friction_n_m=0.15, friction_of_n_m={7: 0.5}, gain={4: 0.5}), np.random.default_rng(0))
    expected = np.full(12, GEAR_LOSS + 0.15)
    expected[7] += 0.5
    assert snake.model.dof_frictionloss[6:] == pytest.approx(expected)
    snake.put_down()
    for error, torque in ((0.1, STIFFNESS * 0.1), (9.0, LIMIT)):
        snake.data.qpos[7:] = 0.0
        snake._line = [np.full(12, error)] * len(snake._line)
        snake._step()
        halved = torque / 2 if error < 1 else torque
        assert snake.data.ctrl == pytest.approx([halved if joint == 4 else torque for joint in range(12)])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "name", "number", "value"),
    [
        ({"friction_n_m": (0.15, 0.15, 0.15)}, "dry-friction", "held_rad", 0.025),
        ({"friction_n_m": (0.0, 0.4, 0.0)}, "joint-friction-elbow", "held_rad", 0.4 / 6),
        ({"gain": 0.5}, "soft-joint-elbow", "strength", 0.5),
        ({"carried_kg": 0.05}, "payload-hand", "load", 0.05 / 0.6),
    ],
)
def test_what_is_hidden_in_an_arm_is_named_with_its_number(arm, hidden, name, number, value):
    """Simulated in steps half as long and with another integrator than the model's."""
    found = bns.diagnose(log(12, seed=5, finer=2, **hidden), arm)
    assert (found.verdict, found.effects) == ("effects", (name,))
    said = found.diagnosis.numbers[name][number]
    assert said["value"] == pytest.approx(value, rel=0.05)
