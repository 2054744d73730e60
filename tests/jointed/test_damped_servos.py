"""Servos with damping and a limited torque move a body as MuJoCo alone moves it: the limit bounds spring and damper together."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bns.physics.jointed.drives import Drive
from bns.physics.jointed.mechanism import Mechanism, machine
from bns.physics.jointed.model_files import load_body
from bns.physics.jointed.simulate import SETTLE_S, Simulator
from tests.jointed.arm import xml

DT_S = 0.004
FREE = 'forcerange="-3 3"'


def body(integrator="RK4", damping=0.4, limit=3.0, stiffness=(6.0, 6.0, 6.0), of_elbow=1.0):
    """The arm in MJCF: servos with damping whose torque is limited, the elbow's stronger or weaker by a factor."""
    text = xml().replace('integrator="implicitfast"', f'integrator="{integrator}"')
    for n, joint in enumerate(("shoulder", "elbow", "wrist")):
        factor = of_elbow if joint == "elbow" else 1.0
        now = f'kp="{stiffness[n] * factor}" kv="{damping * factor}" forcerange="{-limit * factor} {limit * factor}"'
        text = text.replace(f'<position joint="{joint}" kp="6.0" {FREE}/>', f'<position joint="{joint}" {now}/>')
    return text


def set_points(steps=400):
    """Far jumps, so that the torque is at its limit while the joints are fast."""
    goals = np.random.default_rng(4).uniform(-1.5, 1.5, (steps // 50, 3))
    return np.repeat(goals, 50, axis=0)


def driven_by_mujoco(text):
    """Where elbow and hand are in every step, (steps, 2, 2), after the arm has come to rest at its first set point."""
    model = mujoco.MjModel.from_xml_string(text)
    data, told = mujoco.MjData(model), set_points()
    data.qpos[:] = told[0]
    hold = round(SETTLE_S / DT_S) + 1
    seen = []
    for goal in [*np.repeat(told[:1], hold, axis=0), *told]:
        mujoco.mj_kinematics(model, data)
        seen.append([data.site(name).xpos[:2].copy() for name in ("elbow", "hand")])
        data.ctrl[:] = goal
        mujoco.mj_step(model, data)
    return np.array(seen[hold:])


def simulated(text, **changed):
    """The same by the simulator of many drives; ``changed``: factors of the elbow's servo in the plant."""
    arm = machine(Mechanism(text, ("elbow", "hand")))
    plant, told = arm.plant, set_points()
    for name, factor in changed.items():
        plant = replace(plant, **{name: np.array([1.0, factor, 1.0])})
    simulator = Simulator(arm, [Drive(told, np.arange(len(told)), np.zeros(3))], 1)
    start = simulator.at_rest() if not changed else replace(simulator.at_rest(), state=simulator.settled(plant))
    return simulator.sightings(plant, start).point_m


@pytest.mark.parametrize("integrator", ["RK4", "implicitfast", "Euler"])
@pytest.mark.parametrize("damping", [0.0, 0.4])
def test_a_limited_torque_is_that_of_spring_and_damper_together(integrator, damping):
    text = body(integrator, damping)
    at_limit, without = driven_by_mujoco(text), driven_by_mujoco(body(integrator, damping, 1e6))
    assert np.abs(at_limit - without).max() > 0.02  # the limit is felt
    np.testing.assert_allclose(simulated(text), at_limit, atol=1e-6)


def test_a_weak_servo_is_the_one_that_the_file_would_have():
    """Less stiff, less damped and less strong by one factor, within the steps of the integrator as well."""
    weak = driven_by_mujoco(body(of_elbow=0.65))
    assert np.abs(weak - driven_by_mujoco(body())).max() > 0.02
    found = simulated(body(), stiffness=0.65, damping=0.65, torque=0.65)
    np.testing.assert_allclose(found, weak, atol=1e-6)


def test_a_sagging_supply_weakens_damped_servos_too():
    arm = machine(Mechanism(body(), ("elbow", "hand")))
    told = set_points()
    simulator = Simulator(arm, [Drive(told, np.arange(len(told)), np.zeros(3))], 1)
    rest = simulator.at_rest()
    sound, sagging = (simulator.sightings(replace(arm.plant, sag=sag), rest).point_m for sag in (0.0, 0.5))
    assert 0.005 < np.abs(sagging - sound).max() < 0.5


def test_where_the_limits_are_bounded():
    assert machine(Mechanism(body(), ("hand",))).limits_inside
    assert machine(Mechanism(body("Euler", 0.4), ("hand",))).limits_inside
    assert not machine(Mechanism(body("Euler", 0.0), ("hand",))).limits_inside
    assert not machine(load_body("snake").mechanism).limits_inside  # kept as it is: its results are published


def test_an_unstable_simulation_writes_no_file_and_no_lines(tmp_path, monkeypatch, capfd):
    """MuJoCo's own handler adds to MUJOCO_LOG.TXT in the working directory with every step."""
    monkeypatch.chdir(tmp_path)
    text = body("Euler", 0.0, 1e9, (1e9, 1e9, 1e9))
    arm = machine(Mechanism(text, ("elbow", "hand")))
    told = set_points()
    simulator = Simulator(arm, [Drive(told, np.arange(len(told)), np.zeros(3))], 2)
    rest = Simulator(machine(Mechanism(body(), ("elbow", "hand"))), simulator.drives, 1).at_rest()
    simulator.sightings(arm.plant, rest)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.ctrl[:] = np.nan
    mujoco.mj_step(model, data)
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")
