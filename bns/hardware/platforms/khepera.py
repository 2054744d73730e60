"""A Khepera III on its rig: commands driven at their times, watched, and stopped."""

from __future__ import annotations

import math
from importlib import resources
from pathlib import Path

import numpy as np

from bns.errors import HardwareError, TrialPausedError
from bns.hardware.clock import Clock, EmulatedClock
from bns.hardware.emulators.faults import FaultPlan
from bns.hardware.emulators.khepera_rig import EmulatedKheperaRig
from bns.hardware.guard.recipe import StopRecipe, khepera_recipe
from bns.hardware.hardware_log import HardwareLog
from bns.hardware.khepera import BAUD, STILL_M_S, KheperaIII, RobotLostError, check_battery, firmware
from bns.hardware.khepera_settings import khepera_settings
from bns.hardware.platform import Driven
from bns.hardware.rig import Rig
from bns.hardware.safety import DriveEnded, Stopping, StopsAtTheEnd, Watch
from bns.hardware.serial_link import SerialLink
from bns.hardware.stop import Stop
from bns.hardware.tracking.eye import Eye
from bns.hardware.tracking.kinds import open_tracker
from bns.hardware.tracking.sight import Sight, Tracker
from bns.robots.khepera import UNITS_PER_M_S

RIG = resources.files("bns.hardware") / "rigs" / "khepera.yaml"

_TICK_S = 0.1
_HEARTBEATS = 5
"""Every so many looks the robot is asked for its speed: a dead link is noticed within half a second, not at the next command."""

REPEATS = 1
"""How often a trial drives its final controller, unless it is told otherwise: the source shows one drive of it (section 4.3)."""


class KheperaPlatform:
    """Implements `bns.hardware.platform.Platform`. Commands are (left, right, duration) in the robot module's units."""

    def __init__(
        self,
        driver: KheperaIII,
        link: SerialLink,
        tracker: Tracker,
        rig: Rig,
        clock: Clock,
        journal: HardwareLog,
        stopping: Stopping,
    ) -> None:
        self._driver, self._link, self._clock, self._journal = driver, link, clock, journal
        self._eye = Eye(tracker, clock, journal, math.pi / 2)
        self._watch = Watch(rig.limits, clock, stopping)

    @property
    def retries(self) -> int:
        """How often a question was asked again so far."""
        return self._driver.retries

    def pose(self) -> np.ndarray | None:
        """Mean of some looks at the standing robot."""
        sight = self._eye.standing()
        return None if sight is None else sight.pose

    def readings(self) -> dict[str, float]:
        """Battery."""
        try:
            return {"battery_v": self._driver.battery_v()}
        except RobotLostError as error:
            raise TrialPausedError(f"the robot is lost: {error}") from error

    def stop(self) -> Stop:
        """Stop and confirm."""
        return self._driver.stop()

    def close(self) -> None:
        """Give port and tracker free."""
        self._link.close()
        self._eye.close()

    def drive(self, commands: np.ndarray) -> Driven:
        """Drive the commands back to back from where the robot stands."""
        start = self.pose()
        if start is None:
            raise TrialPausedError("the tracker does not see the robot: is it lit, marked and on the surface? Try: bns track")
        drive, ended = _Drive(self, start), ""
        guard = StopsAtTheEnd(self.stop)
        began_s = self._clock.now_s()
        self._watch.begin()
        with guard:
            try:
                for left, right, duration_ms in commands.astype(np.float64).tolist():
                    drive.carry_out(left / UNITS_PER_M_S, right / UNITS_PER_M_S, duration_ms / 1000.0)
            except DriveEnded as end:
                ended = str(end)
            except RobotLostError as error:
                raise TrialPausedError(f"the robot was lost: {error}") from error
        assert guard.last is not None
        seconds = self._clock.now_s() - began_s
        return Driven(drive.done(), np.array(drive.poses), drive.rows, guard.last, ended, seconds)


class _Drive:
    """One drive as it goes on: rows and poses gathered so far."""

    def __init__(self, on: KheperaPlatform, start: np.ndarray) -> None:
        self._on, self._clock = on, on._clock
        self._began_s: float | None = None
        self._carried: list[tuple[float, float, float]] = []
        self.poses, self.rows = [start], [_row(0.0, math.nan, math.nan, start)]

    def done(self) -> np.ndarray:
        """Commands carried out (k, 3): what was sent, in the robot module's units, and the time it lasted."""
        return np.array(self._carried, np.float32).reshape(-1, 3)

    def carry_out(self, left_m_s: float, right_m_s: float, duration_s: float) -> None:
        """One command: sent, watched until its time is over, its end pose seen."""
        asked_s = self._clock.now_s()
        left, right = self._on._driver.set_speed_m_s(left_m_s, right_m_s)
        self._began_s = asked_s if self._began_s is None else self._began_s
        self.rows[-1] |= {"left_m_s": left, "right_m_s": right}
        self._on._journal.note("command", left_m_s=left, right_m_s=right, duration_s=duration_s)
        end_s, looks = asked_s + duration_s, 0
        while self._clock.now_s() + _TICK_S < end_s:
            self._clock.sleep(_TICK_S)
            self._seen(left, right)
            looks += 1
            if looks % _HEARTBEATS == 0:
                self._on._driver.speed_m_s()
        self._clock.sleep(end_s - self._clock.now_s())
        pose = self._end_pose(left, right)
        lasted_s = self._clock.now_s() - asked_s
        self._carried.append((left * UNITS_PER_M_S, right * UNITS_PER_M_S, 1000.0 * lasted_s))
        self.poses.append(pose)
        self.rows[-1] |= {"left_m_s": math.nan, "right_m_s": math.nan}

    def _end_pose(self, left: float, right: float) -> np.ndarray:
        """Where the command ended; if the robot is not seen just then, the command lasts until it is, or the drive ends."""
        while (sight := self._seen(left, right)) is None:
            self._clock.sleep(_TICK_S / 10)
        return sight.pose

    def _seen(self, left: float, right: float) -> Sight | None:
        sight = self._on._eye.look()
        if sight is not None:
            began_s = self._clock.now_s() if self._began_s is None else self._began_s
            self.rows.append(_row(self._clock.now_s() - began_s, left, right, sight.pose))
        self._on._watch.check(sight)
        return sight


def _row(t_s: float, left_m_s: float, right_m_s: float, pose: np.ndarray) -> dict[str, float]:
    x_m, y_m, heading_rad = (float(v) for v in pose)
    return {"t_s": t_s, "left_m_s": left_m_s, "right_m_s": right_m_s, "x_m": x_m, "y_m": y_m, "heading_rad": heading_rad}


def open_platform(rig: Rig, clock: Clock, journal: HardwareLog, stopping: Stopping) -> KheperaPlatform:
    """Open port and tracker, and make sure before anything else that the robot stands still, is charged and is seen."""
    settings = khepera_settings(rig.driver)
    link = SerialLink(rig.port, BAUD, clock, journal, settings.reply)
    try:
        driver = KheperaIII(link, clock, journal, settings.stop_s)
        with StopsAtTheEnd(driver.stop):
            check_battery(driver.battery_v())
        tracker = open_tracker(rig.tracker, clock)
    except RobotLostError as error:
        link.close()
        raise HardwareError(f"the robot answers badly: {error}. Bring it nearer, charge it, try again.") from error
    except BaseException:
        link.close()
        raise
    return KheperaPlatform(driver, link, tracker, rig, clock, journal, stopping)


def stop_recipe(rig: Rig) -> StopRecipe:
    """For the guard: still by the reading of any firmware."""
    return khepera_recipe(BAUD, int(STILL_M_S * firmware(2, 0).units_per_m_s))


def emulate(rig: Rig, folder: Path, clock: EmulatedClock, plan: FaultPlan, seed: int) -> EmulatedKheperaRig:
    """An emulated robot under an emulated Wii remote, their ports in `folder`."""
    return EmulatedKheperaRig(rig, folder, clock, plan, seed)
