"""Robots as public collections of MJCF have them: unnamed geoms, default classes, contact priorities, servos with kv."""

import mujoco
import numpy as np
import pytest

import bns
from bns.api.model import as_model
from bns.diagnose.effect_caveats import on_the_cone
from bns.errors import DataError
from bns.physics.jointed.drives import Drive
from bns.physics.jointed.mechanism import Mechanism, machine
from bns.physics.jointed.model_files import load_body
from bns.physics.jointed.simulate import Simulator, _Servos
from tests.jointed import arm, dog


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("dog") / "dog.xml"
    path.write_text(dog.xml())
    return path


@pytest.fixture(scope="module")
def body(file):
    return load_body(str(file), sites=list(dog.SITES))


@pytest.fixture(scope="module")
def table():
    return dog.log(4, seed=3)


def test_a_quadruped_has_servos_links_and_effects_by_their_own_names(body):
    known = body.catalogue()
    assert machine(body.mechanism).joints == dog.JOINTS
    for name in ("weak-joint-FR_calf_joint", "link-friction-FR_calf", "floor-friction", "marker-offset-head"):
        assert name in known
    assert "link-friction-FR_hip" not in known  # nothing of it may touch the floor
    assert "link-mass-FR_hip" in known


def test_an_arm_may_carry_a_load_though_no_floor_touches_it(tmp_path):
    (tmp_path / "arm.xml").write_text(arm.xml())
    known = load_body(str(tmp_path / "arm.xml")).catalogue()
    assert [name for name in known if name.startswith("link-mass-")] == [f"link-mass-{name}-link" for name in arm.JOINTS]
    assert not [name for name in known if name.startswith("link-friction-")]


def test_a_pyramid_of_friction_is_pointed_out_where_a_body_lies_on_a_floor(tmp_path, body):
    default = tmp_path / "default.xml"
    default.write_text(dog.xml().replace('cone="elliptic" ', ""))
    (tmp_path / "arm.xml").write_text(arm.xml())
    of_default = load_body(str(default), sites=list(dog.SITES))
    assert 'Set <option cone="elliptic"/>' in next(on_the_cone(of_default))
    for model in (body, load_body(str(tmp_path / "arm.xml")), as_model("khepera")):
        assert list(on_the_cone(model)) == []


def test_of_two_that_touch_the_one_with_priority_counts(body):
    model, plain = machine(body.mechanism).model, mujoco.MjModel.from_xml_string(dog.xml())
    data = mujoco.MjData(plain)
    mujoco.mj_resetDataKeyframe(plain, data, 0)
    data.qpos[2] = 0.24
    mujoco.mj_forward(plain, data)
    foot = next(c for c in data.contact if plain.geom_priority[list(c.geom)].max() == 1)
    pair = next(k for k in range(model.npair) if model.geom_priority[model.pair_geom2[k]] == 1)
    assert (model.pair_dim[pair], model.pair_friction[pair, 0]) == (foot.dim, pytest.approx(foot.friction[0])) == (6, 0.8)
    leg = next(k for k in range(model.npair) if model.geom_priority[model.pair_geom2[k]] == 0)
    assert (model.pair_dim[leg], model.pair_friction[leg, 0]) == (3, 1.0)  # of equals the larger ones: the floor's


@pytest.mark.slow
def test_the_model_predicts_what_a_loop_of_its_own_did(file, table):
    error = bns.compare(table, bns.Model(file, sites=list(dog.SITES))).errors
    assert error.loc["stretch", "median_position_m"] < 0.004  # a millimetre of it is the camera's, per coordinate


def test_set_points_are_bounded_as_the_servos_bound_them_but_not_what_makes_their_torque(body):
    m = machine(body.mechanism)
    knee = m.joints.index("FR_calf_joint")
    told = np.tile(np.array(dog.STAND * 4), (3, 1))
    told[:, knee] = -9.0
    stiff = m.plant.with_joint("stiffness", "FR_calf_joint", 3.0)
    q = told[:1].copy()
    q[0, knee] = -2.6
    given = _Servos(m, stiff, [told], 0.002, 0.0).control(0, q)[0, knee]
    stiffer = m.changed(stiff).actuator_gainprm[:, 0] / m.stiffness_n_m_rad  # damped servos: in the model itself
    assert stiffer[knee] * (given + 2.6) == pytest.approx(3.0 * (-2.7 + 2.6))  # the range ends at -2.7
    drives = [Drive(told, np.array([0, 2]), np.zeros(3))]
    assert np.isfinite(Simulator(m, drives, 1).sightings(stiff, Simulator(m, drives, 1).at_rest()).point_m).all()
    assert m.model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL


def test_a_weak_servo_damps_less_too(body):
    m, effect = machine(body.mechanism), body.effect_named("weak-joint-FR_calf_joint")
    knee = m.joints.index("FR_calf_joint")
    weak = m.changed(effect.apply(m.plant, strength=0.4))
    share = weak.actuator_biasprm[:, 2] / m.model.actuator_biasprm[:, 2]
    np.testing.assert_allclose(share, np.where(np.arange(12) == knee, 0.4, 1.0))
    assert m.changed(m.plant) is m.model


def test_sites_that_were_not_tracked_are_to_be_left_out_by_name(file, table):
    with pytest.raises(DataError, match=r"lack imu_x_m.*sites: \[\.\.\.\]"):
        bns.compare(table, bns.Model(file))


def test_geoms_that_have_no_name_get_one():
    xml = dog.xml().replace('name="ground" ', "")
    links = machine(Mechanism(xml, dog.SITES)).on_the_floor
    assert [name for name, _ in links] == ["trunk", *(f"{leg}_{part}" for leg in dog.LEGS for part in ("thigh", "calf"))]


def test_links_of_a_robot_that_is_fixed_to_the_world_lie_on_no_floor(tmp_path):
    file = tmp_path / "fixed.xml"
    file.write_text(dog.xml().replace("<freejoint/>", "").replace('qpos="0 0 0.27 1 0 0 0 ', 'qpos="'))
    fixed = load_body(str(file), sites=list(dog.SITES))
    assert machine(fixed.mechanism).on_the_floor
    assert not [name for name in fixed.catalogue() if name.startswith(("floor-", "link-friction", "friction-"))]


@pytest.mark.slow
def test_the_strength_of_a_knee_is_found(file, tmp_path):
    added = bns.add(dog.log(10, seed=3, strength=0.4), "weak-joint-FR_calf_joint", bns.Model(file, sites=list(dog.SITES)))
    assert added.to_json()["parameters"]["weak-joint-FR_calf_joint"]["strength"]["value"] == pytest.approx(0.4, abs=0.06)
