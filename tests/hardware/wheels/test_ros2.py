"""A ROS 2 robot's driver and platform against a stand-in for the node: no DDS, no rclpy, the physics model as the base."""

import builtins
import sys
from dataclasses import replace

import numpy as np
import pytest

from bns.engine.philox import Key
from bns.errors import HardwareError, StopNotConfirmedError, TrialPausedError
from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.body import DifferentialBody
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.rig import shipped_rig
from bns.hardware.safety import Stopping
from bns.hardware.tracking.sight import Sight
from bns.hardware.wheels.ros2 import Odometry, RclpyNode, Ros2Driver, Ros2Settings, open_ros2, ros2_settings
from bns.hardware.wheels.wheel_drive import RobotLostError
from bns.physics.model import load_model

NORTH = (0.0, 0.0, np.pi / 2)
BASE_M = 0.0884
SETTINGS = Ros2Settings(BASE_M)
TIMEOUT_S = 0.5


class Base:
    """The robot's side: drives what it was told last, stops when nothing comes for half a second, reports at 50 Hz."""

    def __init__(self, clock):
        self.clock = clock
        self.body = DifferentialBody(load_model("khepera-world"), Key.of_run(1, 0, "khepera", "circle"), NORTH)
        self.body.put_down(NORTH, clock.now_s())
        self.orders, self.silent, self.deaf, self.closed = [], False, False, False
        self._told_s, self._found, self._order = -9.0, None, (0.0, 0.0)
        clock.listeners.append(self._goes_on)

    def publish(self, ahead_m_s, turn_rad_s):
        self.orders.append((self.clock.now_s(), ahead_m_s, turn_rad_s))
        if self.deaf:
            return
        self._told_s = self.clock.now_s()
        if (ahead_m_s, turn_rad_s) != self._order:
            self._drive(ahead_m_s, turn_rad_s)

    def _drive(self, ahead, turn):
        self._order = ahead, turn
        self.body.order(ahead - turn * BASE_M / 2, ahead + turn * BASE_M / 2, self.clock.now_s())

    def _goes_on(self, now_s):
        if now_s - self._told_s > TIMEOUT_S and self._order != (0.0, 0.0):
            self._drive(0.0, 0.0)
        if not self.silent and (self._found is None or now_s - self._found.t_s >= 0.02):
            left, right = self.body.wheel_speeds_m_s(now_s)
            self._found = Odometry(now_s, (left + right) / 2, (right - left) / BASE_M)

    def newest(self):
        return self._found

    def close(self):
        self.closed = True
        self.clock.listeners.remove(self._goes_on)


class Eyes:
    def __init__(self, base):
        self._base = base

    def look(self):
        now_s = self._base.clock.now_s()
        return Sight(now_s, self._base.body.pose(now_s))

    def close(self):
        pass


@pytest.fixture
def base(clock):
    return Base(clock)


@pytest.fixture
def driver(base, clock):
    return Ros2Driver(base, SETTINGS, clock, HardwareLog(None, clock))


def platform(base, monkeypatch, **driver):
    monkeypatch.setattr("bns.hardware.wheels.ros2.open_tracker", lambda _settings, _clock: Eyes(base))
    rig = replace(shipped_rig("khepera"), driver={"wheelbase_m": BASE_M, **driver})
    journal = HardwareLog(None, base.clock)
    return open_ros2(rig, base.clock, journal, Stopping(), (1000.0, 1000.0), lambda _settings, _clock: base)


def test_wheels_become_a_twist_and_back(base, driver, clock):
    driver.set_speed_m_s(0.10, 0.14)
    assert base.orders[-1][1:] == pytest.approx((0.12, 0.04 / BASE_M))
    clock.sleep(0.4)
    assert driver.speed_m_s() == pytest.approx((0.10, 0.14), abs=0.004)


def test_encoders_add_up_what_odometry_says(base, driver, clock):
    driver.set_speed_m_s(0.1, 0.1)
    for _ in range(100):
        clock.sleep(0.02)
        ways = driver.encoders_m()
    assert ways == pytest.approx((0.19, 0.19), abs=0.01)


def test_a_drive_is_driven_and_stopped(base, monkeypatch):
    on = platform(base, monkeypatch)
    driven = on.drive(np.array([[120.0, 120.0, 2000.0], [60.0, 120.0, 1500.0]], np.float32))
    assert driven.stop.confirmed
    assert driven.poses[1][1] == pytest.approx(0.23, abs=0.02)
    assert max(np.diff([t_s for t_s, *_ in base.orders])) <= 0.35
    assert on.readings() == {}
    np.testing.assert_allclose(driven.commands[:, :2], [[120, 120], [60, 120]], atol=0.01)
    on.close()
    assert base.closed


def test_a_robot_that_reports_no_more_is_lost_and_pauses(base, driver, clock, monkeypatch):
    on = platform(base, monkeypatch)
    clock.listeners.append(lambda now_s: setattr(base, "silent", now_s > 1.0))
    with pytest.raises((TrialPausedError, StopNotConfirmedError)) as caught:
        on.drive(np.array([[120.0, 100.0, 9000.0]], np.float32))
    assert "no odometry" in str(caught.value)
    assert max(map(abs, base.body.wheel_speeds_m_s(clock.now_s()))) < 0.005


def test_a_stop_that_odometry_does_not_confirm_is_none(base, driver, clock):
    driver.set_speed_m_s(0.1, 0.1)
    base.silent = True
    stop = driver.stop()
    assert (stop.confirmed, stop.problem) == (False, "no odometry comes")
    base.silent, base.deaf = False, True
    base._told_s = 1e9  # its own watchdog is off
    base._drive(0.1, 0.0)
    assert driver.stop().problem == "the wheels still turn"


def test_who_does_not_report_at_all_is_named(base, monkeypatch):
    base.silent = True
    base._found = None
    with pytest.raises((HardwareError, StopNotConfirmedError), match="odometry"):
        platform(base, monkeypatch)


def test_a_silent_robot_is_lost(base, driver):
    base.silent = True
    with pytest.raises(RobotLostError, match=r"no odometry on /odom for 0\.5 s"):
        driver.set_speed_m_s(0.1, 0.1)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "lacks wheelbase_m"),
        ({"wheelbase_m": 0}, "wheelbase_m is 0; it must be a number above 0"),
        ({"wheelbase_m": 0.2, "stop_s": 0}, "stop_s is 0; it must be a number above 0"),
        ({"wheelbase_m": 0.2, "cmd_vell": "/x"}, "unknown setting 'cmd_vell'. Did you mean 'cmd_vel'"),
        ({"wheelbase_m": 0.2, "odometry": "odom"}, "odometry is 'odom'; write a whole topic"),
    ],
)
def test_bad_settings_are_named(given, message):
    with pytest.raises(HardwareError, match=message.replace("'", ".")):
        ros2_settings(given)


def test_without_ros_it_is_said_what_to_do(monkeypatch):
    real = builtins.__import__
    monkeypatch.delitem(sys.modules, "rclpy", raising=False)

    def missing(name, *rest, **more):
        if name.startswith("rclpy"):
            raise ImportError("No module named 'rclpy'")
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(HardwareError, match=r"ROS 2 is not there .*source its setup file"):
        RclpyNode(SETTINGS, EmulatedClock(np.inf))
