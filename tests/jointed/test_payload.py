"""A load at a tracked point: the body moves as one that has a body of its own there."""

import mujoco
import numpy as np
import pytest

from bns.physics.jointed.drives import Drive
from bns.physics.jointed.mechanism import Mechanism, machine
from bns.physics.jointed.model import JointedModel
from bns.physics.jointed.payload import carry
from bns.physics.jointed.simulate import Rest, Simulator, _Outside
from tests.hidden_snake.body import BOARD_KG, MASS_KG, Hidden, Snake
from tests.jointed import dog
from tests.jointed.arm import loaded, xml
from tests.jointed.test_damped_servos import body, driven_by_mujoco, set_points


def bent(text):
    """The arm with inertias that lie along no axis of their links."""
    odd = '<inertial pos="0.08 0.01 0.02" mass="0.2" fullinertia="6e-4 9e-4 8e-4 5e-5 -3e-5 4e-5"/><joint name="elbow"'
    return text.replace('<joint name="elbow"', odd)


@pytest.mark.parametrize(
    ("text", "site", "load_kg"),
    [(xml(), "hand", 0.1), (xml(), "elbow", 0.1), (bent(xml()), "elbow", 0.3), (dog.xml(), "head", 2.0)],
    ids=["tip", "joint", "odd", "dog"],
)
def test_a_link_with_a_load_moves_as_one_that_another_body_is_fixed_to(text, site, load_kg):
    plain, there = mujoco.MjModel.from_xml_string(text), mujoco.MjModel.from_xml_string(loaded(text, site, load_kg))
    carrying = plain.__copy__()
    carry(carrying, int(plain.site(site).bodyid[0]), plain.site(site).pos, load_kg)
    mujoco.mj_setConst(carrying, mujoco.MjData(carrying))
    ends = []
    for model in (carrying, there, plain):
        data, rng = mujoco.MjData(model), np.random.default_rng(0)
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        for step in range(200):
            if step % 50 == 0:
                data.ctrl[:] = rng.uniform(-1, 1, model.nu)
            mujoco.mj_step(model, data)
        ends.append(np.concatenate([data.site(site).xpos, *(data.geom(plain.geom(g).id).xpos for g in range(plain.ngeom))]))
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-5)
    assert np.abs(ends[2] - ends[1]).max() > 1e-3


def test_a_body_with_a_load_has_the_moments_of_both_and_a_frame_of_their_own():
    rng = np.random.default_rng(3)
    for _ in range(12):
        model = mujoco.MjModel.from_xml_string(xml())
        assert model.geom_sameframe[2] == mujoco.mjtSameFrame.mjSAMEFRAME_INERTIA
        point, load_kg = rng.uniform(-0.3, 0.3, 3), rng.uniform(0.01, 1.0)
        before, own_kg = about_origin(model, 3), model.body_mass[3]
        carry(model, 3, point, load_kg)
        expected = before + load_kg * (point @ point * np.eye(3) - np.outer(point, point))
        np.testing.assert_allclose(about_origin(model, 3), expected, atol=1e-12)
        assert model.body_mass[3] == pytest.approx(own_kg + load_kg)
        assert np.linalg.norm(model.body_iquat[3]) == pytest.approx(1.0)
        assert model.body_sameframe[3] == model.geom_sameframe[2] == 0


def test_a_body_whose_inertia_was_in_its_own_frame_is_no_longer_taken_for_one():
    model = mujoco.MjModel.from_xml_string(dog.xml())
    trunk = int(model.site("head").bodyid[0])
    assert model.body_sameframe[trunk] == mujoco.mjtSameFrame.mjSAMEFRAME_BODY
    carry(model, trunk, model.site("head").pos, 1.0)
    assert model.body_sameframe[trunk] == 0


def about_origin(model, number):
    """Inertia (3, 3) of a body about the origin of its frame."""
    turn, at = np.zeros(9), model.body_ipos[number]
    mujoco.mju_quat2Mat(turn, model.body_iquat[number])
    axes = turn.reshape(3, 3)
    own = axes @ np.diag(model.body_inertia[number]) @ axes.T
    return own + model.body_mass[number] * (at @ at * np.eye(3) - np.outer(at, at))


def arm(text):
    """Machine and effects of the arm of that file."""
    mechanism = Mechanism(text, ("elbow", "hand"))
    return machine(mechanism), JointedModel(name="arm", mechanism=mechanism).catalogue()


def test_an_arm_with_a_payload_is_simulated_as_its_file_with_a_load():
    text = body()
    (m, known), told = arm(text), set_points()
    plant = known["payload-hand"].apply(m.plant, load=0.25)
    simulator = Simulator(m, [Drive(told, np.arange(len(told)), np.zeros(3))], 1)
    there = driven_by_mujoco(loaded(text, "hand", 0.25 * 0.6))
    assert np.abs(there - driven_by_mujoco(text)).max() > 0.01
    np.testing.assert_allclose(simulator.sightings(plant, simulator.at_rest()).point_m, there, atol=1e-5)


def test_a_load_is_a_multiple_of_the_mass_that_the_model_has():
    m, known = arm(xml())
    plant = known["payload-hand"].apply(known["link-mass-elbow-link"].apply(m.plant, factor=2.0), load=0.5)
    plant = known["payload-elbow"].apply(plant, load=0.25)
    assert m.masses_kg(plant) == pytest.approx([0.2, 0.4 + 0.15, 0.2 + 0.3])
    assert m.masses_kg(m.plant) == pytest.approx([0.2, 0.2, 0.2])
    assert m.changed(m.plant) is m.model


def test_a_slope_pulls_at_a_load_too():
    mechanism = Mechanism(dog.xml(), dog.SITES)
    m, known = machine(mechanism), JointedModel(name="dog", mechanism=mechanism).catalogue()
    tilted = known["floor-slope"].apply(known["payload-head"].apply(m.plant, load=0.5), east_rad=0.01, north_rad=0.0)
    rest = Rest(np.zeros((1, 1)), np.zeros(1), np.zeros((1, 2)), np.zeros((1, 2)))
    east_n = _Outside(m, tilted, rest)._down[0, :, 0].sum()
    assert east_n == pytest.approx(0.01 * 9.81 * 1.5 * m.model.body_mass.sum())


def test_points_of_the_world_carry_nothing():
    marked = xml().replace("<worldbody>", '<worldbody><site name="base" pos="0 0 0"/>')
    mechanism = Mechanism(marked, ("base", "hand"))
    known = JointedModel(name="arm", mechanism=mechanism).catalogue()
    assert [name for name in known if name.startswith("payload-")] == ["payload-hand"]
    assert {"marker-offset-base", "marker-offset-hand"} <= set(known)


def test_the_second_snake_carries_what_is_hidden_at_its_marker():
    snake = Snake(Hidden(carried_kg={"green": 0.15}), np.random.default_rng(0))
    assert snake.model.body_mass.sum() == pytest.approx(MASS_KG + BOARD_KG + 0.15)
    snake.put_down()
    load = int(np.argmin(np.abs(snake.model.body_mass - 0.15)))
    assert snake.data.xpos[load] == pytest.approx(snake.data.site("green").xpos)
