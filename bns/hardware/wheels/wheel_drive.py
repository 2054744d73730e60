"""One drive of a robot on two wheels: what was ordered when, what was filmed when; rows and poses are made of both at its end."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from bns.hardware.agreement import Agreement
from bns.hardware.clock import Clock
from bns.hardware.leaps import Leaps
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.safety import Watch
from bns.hardware.tracking.eye import Eye
from bns.hardware.tracking.sight import Sight

_TICK_S, _POLL_S, _SUSPECTS_S = 0.1, 0.01, 0.03
_SAME_S = 1e-4
"""Two times closer than this are one."""
_FASTER = 1.5
"""So many times the speed of its faster wheel a robot may be seen to have: poses may differ from orders by half of the way."""
_SPARE_M = 0.2


class RobotLostError(Exception):
    """The robot does not answer any more."""


class Wheels(Protocol):
    """What a drive asks of a robot's driver; speeds are those of the wheels' surfaces, m/s."""

    def set_speed_m_s(self, left: float, right: float) -> tuple[float, float]:
        """Set speeds; what was really sent."""

    def speed_m_s(self) -> tuple[float, float]:
        """Speeds as the robot measures them."""


class Order(NamedTuple):
    """Speeds, m/s, and since when."""

    t_s: float
    left_m_s: float
    right_m_s: float


class WheelDrive:
    """`start` (3,) is where the robot stands. Times of poses are those at which they were filmed.

    Every `heartbeat_looks` looks the robot is asked for its speed: a dead link is noticed soon, not at the next command.
    """

    def __init__(
        self,
        wheels: Wheels,
        eye: Eye,
        watch: Watch,
        agreement: Agreement,
        clock: Clock,
        journal: HardwareLog,
        start: np.ndarray,
        heartbeat_looks: int = 5,
    ) -> None:
        self._wheels, self._eye, self._watch, self._clock, self._journal = wheels, eye, watch, clock, journal
        self._agreement, self._start, self._heartbeat_looks = agreement, start, heartbeat_looks
        self._orders: list[Order] = []
        self._ends_s: list[float] = []
        self._seen: list[tuple[float, np.ndarray]] = []
        self.leaps, self._fastest_m_s, self._apart_m_s = Leaps(), 0.0, 0.0
        self.doubt: Callable[[], None] = lambda: None
        """Called where the wheels tell other speeds than were ordered; what it raises ends the drive."""
        self.over_s = math.inf
        """When the last command was over, as the robot was to be stopped."""
        self.told_m = np.zeros(2)
        """How far the wheels have turned by the speeds that the robot told, twice a second."""

    def carry_out(self, left_m_s: float, right_m_s: float, duration_s: float) -> None:
        """One command, watched until its time is over; if the robot is not seen just then, it lasts until it is."""
        asked_s = self._clock.now_s()
        left, right = self._wheels.set_speed_m_s(left_m_s, right_m_s)
        if not self._orders:
            self._seen.append((asked_s, self._start))
            self.leaps.seen(asked_s, self._start[:2], 0.0, float(self._start[2]))
        self._fastest_m_s = max(self._fastest_m_s, abs(left), abs(right))
        self._apart_m_s = max(self._apart_m_s, abs(left), abs(right), abs(left - right))  # one of them may be held
        self._orders.append(Order(asked_s, left, right))
        self._agreement.ordered(asked_s, left, right)
        self._journal.note("command", left_m_s=left, right_m_s=right, duration_s=duration_s)
        end_s, slept_s = asked_s + duration_s, 0.0
        while self._clock.now_s() + _TICK_S < end_s:
            slept_s += self._sleep()
            self._look()
            if slept_s > (self._heartbeat_looks - 0.5) * _TICK_S:
                speeds = self._wheels.speed_m_s()
                self.told_m += np.array(speeds) * slept_s
                slept_s = 0.0
                self._agreement.measured(self._clock.now_s(), *speeds)
                if self._agreement.doubts_wheels:
                    self.doubt()
        self._clock.sleep(end_s - self._clock.now_s())
        while self._look() is None:
            self._clock.sleep(_POLL_S)
        self._ends_s.append(self._clock.now_s())

    def _sleep(self) -> float:
        """Until the next look: sooner where no picture comes, or one that does not fit; for how long."""
        tick_s = _SUSPECTS_S if self._agreement.suspects else _TICK_S
        tick_s = self._watch.next_look_s(tick_s, self._eye.picture_s)
        self._clock.sleep(tick_s)
        return tick_s

    def finish(self) -> None:
        """The last command goes on until its end has been filmed: a pose after it is needed to know where that was."""
        while self._ends_s and self._seen[-1][0] < self._ends_s[-1]:
            self._clock.sleep(_POLL_S)
            self._look()

    def _look(self) -> Sight | None:
        sight = self._eye.look()
        if sight is not None and self._seen and sight.t_s > self._seen[-1][0] + _SAME_S:
            self._seen.append((sight.t_s, sight.pose))
        self._watch.check(sight, self._eye.picture_s)
        if sight is not None:
            if self._orders:  # if it lasts, it is the agreement of poses and orders that pauses the trial
                fastest_rad_s = _FASTER * self._apart_m_s / self._agreement.wheelbase_m
                self.leaps.seen(sight.t_s, sight.pose[:2], _FASTER * self._fastest_m_s, float(sight.pose[2]), fastest_rad_s)
            self._agreement.seen(sight)
        return sight

    def ordered_m(self) -> tuple[np.ndarray, float]:
        """How far the wheels should have turned by now (2,), and how far one can have, in either direction."""
        ends = [order.t_s for order in self._orders[1:]] + [min(self._clock.now_s(), self.over_s)] * bool(self._orders)
        ways = np.array([[order.left_m_s, order.right_m_s] for order in self._orders]).reshape(-1, 2)
        ways *= np.array([end_s - order.t_s for order, end_s in zip(self._orders, ends, strict=True)])[:, None]
        return ways.sum(axis=0), _SPARE_M + _FASTER * float(np.abs(ways).max(axis=1).sum())

    @property
    def _filmed(self) -> int:
        """How many commands have an end that was filmed."""
        return sum(end_s <= self._seen[-1][0] for end_s in self._ends_s)

    def carried(self) -> np.ndarray:
        """Commands whose end was seen (k, 3): left and right, m/s, as they were sent, and how long they lasted, s."""
        pairs = zip(self._orders[: self._filmed], self._ends_s, strict=False)
        return np.array([[order.left_m_s, order.right_m_s, end_s - order.t_s] for order, end_s in pairs]).reshape(-1, 3)

    def poses(self) -> np.ndarray:
        """Poses (k + 1, 3): at the start, and at the end of each command whose end was seen."""
        ends = [self._pose_at(end_s) for end_s in self._ends_s[: self._filmed]]
        return np.array([self._start, *ends])

    def rows(self) -> list[dict[str, float]]:
        """Measurements: a row a pose filmed, and one at each change of command, its pose between the two filmed around it.

        A command holds from its row on; the last row of a drive that came to its end has none.
        """
        if not self._orders:
            return [_row(0.0, math.nan, math.nan, self._start)]
        whole = len(self._ends_s) == len(self._orders) == self._filmed
        until_s = self._ends_s[-1] if whole else self._seen[-1][0]
        found, began_s = [], self._orders[0].t_s
        for order, next_s in zip(self._orders, [*(o.t_s for o in self._orders[1:]), until_s], strict=True):
            if order.t_s > until_s:
                break
            found.append(_row(order.t_s - began_s, order.left_m_s, order.right_m_s, self._pose_at(order.t_s)))
            between = [(t_s, p) for t_s, p in self._seen if order.t_s + _SAME_S < t_s < min(next_s, until_s) - _SAME_S]
            found += [_row(t_s - began_s, order.left_m_s, order.right_m_s, pose) for t_s, pose in between]
        if until_s - began_s > found[-1]["t_s"] + _SAME_S:
            speeds = (math.nan, math.nan) if whole else self._orders[-1][1:]
            found.append(_row(until_s - began_s, *speeds, self._pose_at(until_s)))
        return found

    def _pose_at(self, t_s: float) -> np.ndarray:
        """Between the two poses filmed around that time."""
        times, poses = np.array([t for t, _ in self._seen]), np.array([pose for _, pose in self._seen])
        return np.array([np.interp(t_s, times, column) for column in poses.T])


def _row(t_s: float, left_m_s: float, right_m_s: float, pose: np.ndarray) -> dict[str, float]:
    x_m, y_m, heading_rad = (float(v) for v in pose)
    return {"t_s": t_s, "left_m_s": left_m_s, "right_m_s": right_m_s, "x_m": x_m, "y_m": y_m, "heading_rad": heading_rad}
