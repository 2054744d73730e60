"""The emulated body is the physics world's, however its orders come."""

import numpy as np
import pytest

from bns.engine.philox import Key
from bns.hardware.emulators.body import DifferentialBody
from bns.hardware.emulators.braking import FULL_VOLTAGE_M_S, Braking, motor_tau_s
from bns.physics.model import load_model
from bns.physics.wheels.differential_drive import simulate

NORTH = (0.0, 0.0, np.pi / 2)
COMMANDS = np.array([[0.1, 0.2, 1.3], [0.2, 0.05, 0.7], [0.03, 0.03, 2.1]])


def quiet():
    from dataclasses import replace

    return DifferentialBody(replace(load_model("khepera-world"), jitter_relative=0.0), Key(1, 2), NORTH)


def drive(body, begin_s=0.0, look_s=None):
    now_s, poses = begin_s, []
    for left, right, duration in COMMANDS:
        body.order(left, right, now_s)
        if look_s:
            [body.pose(now_s + t) for t in np.arange(0, duration, look_s)]
        now_s += duration
        poses.append(body.pose(now_s))
    return np.array(poses)


@pytest.mark.parametrize("look_s", [None, 0.03])
def test_poses_are_those_of_the_physics_model(look_s):
    body = quiet()
    expected = simulate(body.model, *COMMANDS.T[:, None, :], start=NORTH)[0]
    np.testing.assert_allclose(drive(body, look_s=look_s), expected, atol=2e-4)


def test_after_a_rest_a_drive_is_the_same_from_another_place():
    body = quiet()
    first = drive(body)
    body.order(0.0, 0.0, 5.0)
    body.put_down(NORTH, 20.0)
    np.testing.assert_allclose(drive(body, begin_s=20.0), first, atol=1e-9)


def test_it_drives_on_from_where_it_came_to_rest():
    body = quiet()
    body.order(0.1, 0.1, 0.0)
    body.order(0.0, 0.0, 1.0)
    body.order(0.0, 0.0, 1.05)  # told again while it brakes: that changes nothing
    rolled = body.pose(1.5)
    body.order(0.1, 0.1, 10.0)
    np.testing.assert_array_equal(rolled, body.pose(10.0))
    assert body.pose(11.0)[1] - body.pose(10.0)[1] == pytest.approx(0.09, abs=0.005)


def test_an_order_to_stand_is_forgotten_by_a_later_order():
    stopped, driven = quiet(), quiet()
    for body in (stopped, driven):
        body.order(0.1, 0.1, 0.0)
    stopped.order(0.0, 0.0, 1.0)
    for body in (stopped, driven):
        body.order(0.1, 0.1, 1.01)  # before the first has reached the wheels
    np.testing.assert_allclose(stopped.pose(2.0), driven.pose(2.0), atol=1e-9)


@pytest.mark.parametrize("speeds", [(0.208, 0.208), (0.208, 0.05), (-0.1, 0.15), (0.0, 0.0)])
def test_wheels_brake_as_a_motor_with_its_voltage_against_it(speeds):
    """The closed form against small steps of dw/dt = -(v + w)/tau."""
    tau_s, dt_s = motor_tau_s(0.08), 1e-5
    braking = Braking(3.0, np.array(NORTH), np.array(speeds), 0.0884, tau_s)
    pose, wheels = np.array(NORTH), np.array(speeds)
    for step in range(15_000):
        if step == 5000:
            np.testing.assert_allclose(braking.pose_at(3.0 + step * dt_s), pose, atol=3e-4)
        left, right = wheels * dt_s
        pose = pose + np.array([np.cos(pose[2]), np.sin(pose[2]), 0.0]) * (left + right) / 2 + [0, 0, (right - left) / 0.0884]
        wheels = np.sign(wheels) * np.maximum(np.abs(wheels) - (FULL_VOLTAGE_M_S + np.abs(wheels)) / tau_s * dt_s, 0.0)
    np.testing.assert_allclose(braking.pose_at(9.0), pose, atol=3e-4)


def test_from_full_speed_a_wheel_stands_after_half_the_time_that_it_took_to_speed_up():
    body = quiet()
    body.order(0.208, 0.208, 0.0)
    body.order(0.0, 0.0, 2.0)
    assert body.wheel_speeds_m_s(2.02)[0] == pytest.approx(0.208, rel=0.03)
    assert body.wheel_speeds_m_s(2.12)[0] > 0.01
    assert body.wheel_speeds_m_s(2.17) == (0.0, 0.0)


def test_jitter_is_drawn_by_key():
    def end(key):
        return drive(DifferentialBody(load_model("khepera-world"), key, NORTH))[-1]

    np.testing.assert_array_equal(end(Key(1, 2)), end(Key(1, 2)))
    assert not np.array_equal(end(Key(1, 2)), end(Key(2, 2)))


def test_wheel_speeds_come_from_the_motion():
    body = quiet()
    body.order(0.1, 0.2, 0.0)
    assert body.wheel_speeds_m_s(1.5) == pytest.approx((0.1, 0.2), abs=0.004)
    assert body.wheel_speeds_m_s(0.0) == pytest.approx((0.0, 0.0), abs=0.001)
