"""A robot on two wheels that ROS 2 drives: orders as geometry_msgs/Twist on `cmd_vel`, what it does from nav_msgs/Odometry.

A platform module of a robot's package calls `open_ros2`; `rclpy` comes with a ROS 2 installation, not from PyPI. Driver and
platform are tested against a stand-in for the node, without DDS; no ROS 2 robot has been driven with it.

Twist and Odometry have no acknowledgement: an order counts as taken when odometry that is younger than it has come. So the
robot's own base must stop when orders cease, as ros2_control's diff_drive_controller does (`cmd_vel_timeout`, half a second);
while a drive goes on the order is published again, twice within that time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from bns.errors import HardwareError, unknown_name
from bns.hardware.clock import Clock
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.rig import Rig
from bns.hardware.safety import Stopping, StopsAtTheEnd
from bns.hardware.stop import Stop
from bns.hardware.tracking.kinds import open_tracker
from bns.hardware.wheels.wheel_drive import RobotLostError
from bns.hardware.wheels.wheeled import WheeledPlatform, Wheels

STILL_M_S = 0.005
_POLL_S = 0.01
_READINGS = 2


class Odometry(NamedTuple):
    """What a robot says of itself, and when it came: forward speed, m/s, and turn, rad/s, counter-clockwise."""

    t_s: float
    ahead_m_s: float
    turn_rad_s: float


class Node(Protocol):
    """What is asked of ROS: a node that lives until it is closed."""

    def publish(self, ahead_m_s: float, turn_rad_s: float) -> None:
        """An order, on the topic of orders."""

    def newest(self) -> Odometry | None:
        """The newest odometry; None before the first."""

    def close(self) -> None:
        """Leave the graph."""


@dataclass(frozen=True)
class Ros2Settings:
    """A rig's `driver`: topics; how long no odometry may come before the robot counts as lost; the wheelbase, m."""

    wheelbase_m: float
    cmd_vel: str = "/cmd_vel"
    odometry: str = "/odom"
    lost_s: float = 0.5
    stop_s: float = 5.0


def ros2_settings(driver: Mapping[str, Any]) -> Ros2Settings:
    """The settings in a rig's `driver`; HardwareError names one that is wrong."""
    known = ("wheelbase_m", "cmd_vel", "odometry", "lost_s", "stop_s")
    if unknown := [name for name in driver if name not in known]:
        raise HardwareError(f"the ROS 2 driver: {unknown_name('setting', unknown[0], known)}")
    if "wheelbase_m" not in driver:
        raise HardwareError("the ROS 2 driver of the rig lacks wheelbase_m: how far the wheels stand apart, m.")
    for name in ("wheelbase_m", "lost_s", "stop_s"):
        value = driver.get(name, 1.0)
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
            raise HardwareError(f"the ROS 2 driver's {name} is {value!r}; it must be a number above 0.")
    for name in ("cmd_vel", "odometry"):
        if not str(driver.get(name, "/x")).startswith("/"):
            raise HardwareError(f"the ROS 2 driver's {name} is {driver[name]!r}; write a whole topic, as /odom.")
    return Ros2Settings(**driver)


class Ros2Driver:
    """Implements `bns.hardware.wheels.wheeled.WheelDriver` over a node."""

    def __init__(self, node: Node, settings: Ros2Settings, clock: Clock, journal: HardwareLog) -> None:
        self._node, self._settings, self._clock, self._journal = node, settings, clock, journal
        self.retries = 0
        self._ways_m, self._counted_s = [0.0, 0.0], -1.0
        self._order = (0.0, 0.0)

    def close(self) -> None:
        """Leave the graph."""
        self._node.close()

    def set_speed_m_s(self, left: float, right: float) -> tuple[float, float]:
        """Publish an order; it was taken once younger odometry comes. RobotLostError if none does."""
        self._order = (left + right) / 2.0, (right - left) / self._settings.wheelbase_m
        began_s = self._clock.now_s()
        self._publish()
        self._younger(began_s)
        return left, right

    def speed_m_s(self) -> tuple[float, float]:
        """By the newest odometry; the order is published again, so that the base goes on with it. RobotLostError."""
        self._publish()
        return self._wheels(self._younger(self._clock.now_s() - self._settings.lost_s))

    def encoders_m(self) -> tuple[float, float]:
        """Ways of the wheels, added up from odometry."""
        self.speed_m_s()
        left_m, right_m = self._ways_m
        return left_m, right_m

    def battery_v(self) -> float:
        """Nothing says it: sensor_msgs/BatteryState is not listened to."""
        return math.nan

    def stop(self) -> Stop:
        """Publish zero until odometry says twice that the robot stands; never raises."""
        began_s, acknowledged_s, still, seen_s = self._clock.now_s(), None, 0, -math.inf
        self._order, problem = (0.0, 0.0), "no odometry comes"
        while still < _READINGS and self._clock.now_s() - began_s <= self._settings.stop_s:
            self._publish()
            self._clock.sleep(2 * _POLL_S)
            found = self._node.newest()
            if found is None or found.t_s <= max(began_s, seen_s):
                continue
            seen_s, acknowledged_s = found.t_s, acknowledged_s or found.t_s - began_s
            still = still + 1 if max(map(abs, self._wheels(found))) < STILL_M_S else 0
            problem = "the wheels still turn"
        seconds, confirmed = self._clock.now_s() - began_s, still == _READINGS
        self._journal.note("stop", confirmed=confirmed, seconds=seconds, problem="" if confirmed else problem)
        return Stop(confirmed, seconds, acknowledged_s, "" if confirmed else problem)

    def _publish(self) -> None:
        self._journal.note("sent", ahead_m_s=self._order[0], turn_rad_s=self._order[1])
        self._node.publish(*self._order)

    def _younger(self, than_s: float) -> Odometry:
        """The newest odometry, if it is younger than that; waited for, for as long as the robot may be silent."""
        end_s = self._clock.now_s() + self._settings.lost_s
        while (found := self._node.newest()) is None or found.t_s < than_s:
            if self._clock.now_s() > end_s:
                raise RobotLostError(f"no odometry on {self._settings.odometry} for {self._settings.lost_s:g} s")
            self._clock.sleep(_POLL_S)
        self._count(found)
        return found

    def _count(self, found: Odometry) -> None:
        if self._counted_s >= 0.0:
            lasted_s = max(0.0, found.t_s - self._counted_s)
            self._ways_m = [m + v * lasted_s for m, v in zip(self._ways_m, self._wheels(found), strict=True)]
        self._counted_s = max(self._counted_s, found.t_s)

    def _wheels(self, found: Odometry) -> tuple[float, float]:
        half_m_s = found.turn_rad_s * self._settings.wheelbase_m / 2.0
        return found.ahead_m_s - half_m_s, found.ahead_m_s + half_m_s


class RclpyNode:
    """Implements `Node` with rclpy, which is spun in a thread of its own."""

    def __init__(self, settings: Ros2Settings, clock: Clock) -> None:
        try:
            import rclpy  # noqa: PLC0415  # comes with ROS 2, not with this package
            from geometry_msgs.msg import Twist  # noqa: PLC0415
            from nav_msgs.msg import Odometry as OdometryMessage  # noqa: PLC0415
            from rclpy.executors import SingleThreadedExecutor  # noqa: PLC0415
        except ImportError as error:
            raise HardwareError(
                f"ROS 2 is not there ({error}). Install it, and source its setup file first: . /opt/ros/jazzy/setup.bash"
            ) from error
        import threading  # noqa: PLC0415

        self._clock, self._twist = clock, Twist
        self._found: Odometry | None = None
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self._node = rclpy.create_node("bns_trial", context=self._context)
        self._orders = self._node.create_publisher(Twist, settings.cmd_vel, 1)
        self._node.create_subscription(OdometryMessage, settings.odometry, self._heard, 1)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._executor.spin, name="ros 2", daemon=True)
        self._thread.start()

    def _heard(self, message: Any) -> None:
        speed = message.twist.twist
        self._found = Odometry(self._clock.now_s(), float(speed.linear.x), float(speed.angular.z))

    def publish(self, ahead_m_s: float, turn_rad_s: float) -> None:
        """An order."""
        message = self._twist()
        message.linear.x, message.angular.z = ahead_m_s, turn_rad_s
        self._orders.publish(message)

    def newest(self) -> Odometry | None:
        """The newest odometry."""
        return self._found

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._thread.join(timeout=5)
        self._node.destroy_node()
        self._context.try_shutdown()


def open_ros2(
    rig: Rig,
    clock: Clock,
    journal: HardwareLog,
    stopping: Stopping,
    units: tuple[float, float],
    node: Callable[[Ros2Settings, Clock], Node] = RclpyNode,
) -> WheeledPlatform:
    """What a robot's `open_platform` returns. ``units``: of its commands' speed for 1 m/s, of their duration for 1 s."""
    settings = ros2_settings(rig.driver)
    driver = Ros2Driver(node(settings, clock), settings, clock, journal)
    try:
        with StopsAtTheEnd(driver.stop):
            driver.speed_m_s()
        tracker = open_tracker(rig.tracker, clock)
    except RobotLostError as error:
        driver.close()
        raise HardwareError(f"the robot does not report: {error}. Try: ros2 topic hz {settings.odometry}") from error
    except BaseException:
        driver.close()
        raise
    wheels = Wheels(*units, settings.wheelbase_m, heartbeat_looks=2)
    return WheeledPlatform(driver, tracker, wheels, rig, clock, journal, stopping)
