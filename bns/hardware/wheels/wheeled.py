"""Any robot on two wheels on its rig: commands driven at their times, watched, and stopped. What differs is its driver."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from bns.errors import TrialPausedError
from bns.hardware.agreement import Agreement
from bns.hardware.clock import Clock
from bns.hardware.delay import Motion, turned
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.platform import Driven
from bns.hardware.rig import Rig
from bns.hardware.safety import DriveEnded, Stopping, StopsAtTheEnd, Watch
from bns.hardware.stop import Stop
from bns.hardware.tracking.eye import Eye
from bns.hardware.tracking.kinds import delay_of
from bns.hardware.tracking.sight import Tracker
from bns.hardware.wheels.wheel_drive import RobotLostError, WheelDrive

_AT_ZERO_M, _TURNED_M, _OFF_SHARE = 0.01, 0.05, 0.05
"""Counters so near zero have begun again where wheels must be further from there, by more than orders may be off."""
_NEAR_ZERO_M = 50.0
"""Counters nearer to zero are set anew before a drive, which is not expected to go so far."""
_RESTARTED = (
    "the robot has restarted during the drive: its counters of the wheels began again at zero. Its battery is low, worn or "
    "loose, or its switch was touched: charge it, see that it sits firmly"
)
_LEAPT = (
    "the counters of the robot's wheels leapt by {0:.1f} m during the drive, and can have turned by {1:.1f} m at most: its "
    "answers are wrong, or another program set the counters. Bring it nearer, and see what it answers: bns doctor --rig FILE"
)
_NOT_SEEN = "the tracker does not see the robot: is it lit, marked and on the surface? Try: bns track"


class WheelDriver(Protocol):
    """What the driver of such a robot does; RobotLostError from whatever is asked of one that does not answer any more."""

    retries: int
    """How often a question was asked again so far."""

    def set_speed_m_s(self, left: float, right: float) -> tuple[float, float]:
        """Set the speeds of the wheels' surfaces, m/s; what was really sent, once the robot has acknowledged it."""

    def speed_m_s(self) -> tuple[float, float]:
        """Speeds of the wheels' surfaces as the robot measures them, m/s."""

    def encoders_m(self) -> tuple[float, float]:
        """Way of the wheels' surfaces since any fixed instant, m."""

    def battery_v(self) -> float:
        """Voltage of the battery; NaN of a robot that does not tell."""

    def stop(self) -> Stop:
        """Stop, and see that the wheels stand still; never raises."""

    def close(self) -> None:
        """Give the link free."""


def flat_text(volts: float, least_v: float) -> str:
    """That a battery is too low, its voltage with as many digits as show that."""
    shown = next((text for digits in range(1, 5) if float(text := f"{volts:.{digits}f}") < least_v), f"{volts}")
    return f"the battery is at {shown} V; charge it to {least_v:g} V or more first."


@dataclass(frozen=True)
class Wheels:
    """The robot's numbers: of its commands' speed for one metre per second, of their duration for one second; wheelbase."""

    units_per_m_s: float
    units_per_s: float
    wheelbase_m: float
    heartbeat_looks: int = 5
    """Every so many looks (a tenth of a second each) the robot is asked for its speed. A robot that stops by itself when it hears
    nothing for half a second needs 2."""
    least_v: float = 0.0
    """Nothing is driven on a battery below this voltage."""


class WheeledPlatform:
    """Implements `bns.hardware.platform.Platform`. Commands are (left, right, duration) in the units of ``wheels``."""

    def __init__(
        self,
        driver: WheelDriver,
        tracker: Tracker,
        wheels: Wheels,
        rig: Rig,
        clock: Clock,
        journal: HardwareLog,
        stopping: Stopping,
    ) -> None:
        self._driver, self._wheels, self._clock, self._journal = driver, wheels, clock, journal
        self._eye = Eye(tracker, clock, journal, math.pi / 2, delay_of(rig.tracker), rig.tracker["kind"])
        self._units = np.array([wheels.units_per_m_s, wheels.units_per_m_s, wheels.units_per_s])
        self._asked = lambda: stopping.reason
        self._watch, self._disagree_s = Watch(rig.limits, clock, stopping), rig.limits.disagree_s

    @property
    def retries(self) -> int:
        """How often a question was asked again so far."""
        return self._driver.retries

    def pose(self) -> np.ndarray | None:
        """Mean of some looks at the standing robot."""
        sight = self._eye.standing()
        return None if sight is None else sight.pose

    def readings(self) -> dict[str, float]:
        """Battery; TrialPausedError if it is too low for another drive."""
        try:
            volts = self._driver.battery_v()
        except RobotLostError as error:
            raise TrialPausedError(f"the robot is lost: {error}") from error
        if volts < self._wheels.least_v:
            raise TrialPausedError(flat_text(volts, self._wheels.least_v))
        return {} if math.isnan(volts) else {"battery_v": volts}

    def stop(self) -> Stop:
        """Stop; confirmed by the wheels, and by the tracker where it sees the robot: wheels may say that they stand, and turn."""
        stop = self._driver.stop()
        moving = self._eye.moving() if stop.confirmed else ""
        if not moving:
            return stop
        problem = f"its wheels say that they stand, but {moving}"
        self._journal.note("moving", problem=problem)
        return replace(stop, confirmed=False, problem=problem)

    def close(self) -> None:
        """Give port and tracker free."""
        self._driver.close()
        self._eye.close()

    def move_about(self, seconds: float) -> Motion:
        """Turn to and fro on the spot, for the tracker's delay; stopped at the end. TrialPausedError, StopNotConfirmedError."""
        if self.pose() is None:
            raise TrialPausedError(_NOT_SEEN)
        with StopsAtTheEnd(self.stop, self._asked):
            try:
                return turned(self._driver, self._eye, self._watch, self._clock, seconds)
            except (RobotLostError, DriveEnded) as error:
                raise TrialPausedError(f"the robot could not be turned about: {error}") from error

    def drive(self, commands: np.ndarray) -> Driven:
        """Drive the commands back to back from where the robot stands."""
        start = self.pose()
        if start is None:
            raise TrialPausedError(_NOT_SEEN)
        agreement = Agreement(self._disagree_s, self._wheels.wheelbase_m)
        often = self._wheels.heartbeat_looks
        drive = WheelDrive(self._driver, self._eye, self._watch, agreement, self._clock, self._journal, start, often)
        ended, before_m = "", self._marked()
        drive.doubt = lambda: self._check_restarted(before_m, drive)
        guard = StopsAtTheEnd(self.stop, self._asked)
        began_s = self._clock.now_s()
        self._watch.begin()
        try:
            with guard:
                try:
                    for command in commands / self._units:
                        drive.carry_out(*command.tolist())
                    drive.finish()
                except DriveEnded as end:
                    ended = str(end)
                except RobotLostError as error:
                    raise TrialPausedError(f"the robot was lost: {error}") from error
                finally:
                    drive.over_s = self._clock.now_s()
        except TrialPausedError as error:
            if self._asked() is None:
                self._check_restarted(before_m, drive, error)
            raise
        assert guard.last is not None
        seconds = self._clock.now_s() - began_s
        self._check_restarted(before_m, drive)
        done = (drive.carried() * self._units).astype(np.float32)
        leaps, note = drive.leaps.count, self._too_slow(commands[: len(done)] / self._units)
        return Driven(done, drive.poses(), drive.rows(), guard.last, ended, seconds, leaps=leaps, note=note)

    def _too_slow(self, commands: np.ndarray) -> str:
        """That there are speeds which the robot does not regulate; nothing if there are none, or if it does not say which."""
        least_m_s, speeds = float(getattr(self._driver, "least_m_s", 0.0)), np.abs(commands[:, :2])
        if not ((speeds > 0.0) & (speeds < least_m_s)).any():
            return ""
        return (
            f"some commands are slower than {least_m_s:.3f} m/s, which the robot's firmware does not regulate: wheels may turn "
            "at another speed, or not at all"
        )

    def _counted(self) -> np.ndarray | None:
        """Ways of the wheels (2,), m; None of a robot whose counters do not begin at zero when it starts, or of a silent one."""
        if not getattr(self._driver, "counts_from_its_start", False):
            return None
        try:
            return np.array(self._driver.encoders_m())
        except RobotLostError:
            return None

    def _marked(self) -> np.ndarray | None:
        """The same before a drive: counters near zero are set far from there, else a restart soon after could not be seen."""
        counted_m, mark = self._counted(), getattr(self._driver, "mark_encoders", None)
        if counted_m is None or mark is None or np.abs(counted_m).min() > _NEAR_ZERO_M:
            return counted_m
        with suppress(RobotLostError):  # then they stay as they are
            mark()
        return self._counted()

    def _check_restarted(self, before_m: np.ndarray | None, drive: WheelDrive, error: Exception | None = None) -> None:
        """TrialPausedError if the counters, at ``before_m`` when the drive began, have begun again since: they leapt, or are at
        zero though the wheels, by their orders and by the speeds that they told, have brought them away from there."""
        if before_m is None or (now_m := self._counted()) is None:
            return
        ordered_m, furthest_m = drive.ordered_m()
        turned_m = _TURNED_M + _OFF_SHARE * furthest_m
        leapt_m = float(np.abs(now_m - before_m).max())
        if leapt_m > furthest_m and np.abs(now_m).max() > furthest_m:  # a robot that restarted has driven on from zero
            raise TrialPausedError(_LEAPT.format(leapt_m, furthest_m)) from error
        away = np.minimum(np.abs(before_m + ordered_m), np.abs(before_m + drive.told_m)) > turned_m
        if leapt_m > furthest_m or (np.abs(now_m).max() < _AT_ZERO_M and away.any()):
            raise TrialPausedError(_RESTARTED) from error
