"""A Khepera III on its rig: commands driven at their times, watched, and stopped."""

from __future__ import annotations

import math
from importlib import resources
from pathlib import Path

import numpy as np

from bns.errors import HardwareError, TrialPausedError
from bns.hardware.agreement import Agreement
from bns.hardware.clock import Clock, EmulatedClock
from bns.hardware.delay import Turns, turned
from bns.hardware.emulators.faults import FaultPlan
from bns.hardware.emulators.khepera_rig import EmulatedKheperaRig
from bns.hardware.guard.recipe import StopRecipe, khepera_recipe
from bns.hardware.hardware_log import HardwareLog
from bns.hardware.khepera import BAUD, STILL_M_S, WHEELBASE_M, KheperaIII, RobotLostError, check_battery, firmware
from bns.hardware.khepera_settings import khepera_settings
from bns.hardware.platform import Driven
from bns.hardware.rig import Rig
from bns.hardware.safety import DriveEnded, Stopping, StopsAtTheEnd, Watch
from bns.hardware.serial_link import SerialLink
from bns.hardware.stop import Stop
from bns.hardware.tracking.eye import Eye
from bns.hardware.tracking.kinds import delay_of, open_tracker
from bns.hardware.tracking.sight import Tracker
from bns.hardware.wheel_drive import WheelDrive
from bns.robots.khepera import UNITS_PER_M_S

RIG = resources.files("bns.hardware") / "rigs" / "khepera.yaml"

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
        self._eye = Eye(tracker, clock, journal, math.pi / 2, delay_of(rig.tracker))
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

    def turn_about(self, seconds: float) -> Turns:
        """Turn to and fro on the spot, for the tracker's delay; stopped at the end. TrialPausedError, StopNotConfirmedError."""
        if self.pose() is None:
            raise TrialPausedError("the tracker does not see the robot: is it lit, marked and on the surface? Try: bns track")
        with StopsAtTheEnd(self.stop):
            try:
                return turned(self._driver, self._eye, self._watch, self._clock, seconds)
            except (RobotLostError, DriveEnded) as error:
                raise TrialPausedError(f"the robot could not be turned about: {error}") from error

    def drive(self, commands: np.ndarray) -> Driven:
        """Drive the commands back to back from where the robot stands."""
        start = self.pose()
        if start is None:
            raise TrialPausedError("the tracker does not see the robot: is it lit, marked and on the surface? Try: bns track")
        agreement = Agreement(self._disagree_s, WHEELBASE_M)
        drive = WheelDrive(self._driver, self._eye, self._watch, agreement, self._clock, self._journal, start)
        ended = ""
        guard = StopsAtTheEnd(self.stop)
        began_s = self._clock.now_s()
        self._watch.begin()
        with guard:
            try:
                for left, right, duration_ms in commands.astype(np.float64).tolist():
                    drive.carry_out(left / UNITS_PER_M_S, right / UNITS_PER_M_S, duration_ms / 1000.0)
                drive.finish()
            except DriveEnded as end:
                ended = str(end)
            except RobotLostError as error:
                raise TrialPausedError(f"the robot was lost: {error}") from error
        assert guard.last is not None
        seconds = self._clock.now_s() - began_s
        done = (drive.carried() * [UNITS_PER_M_S, UNITS_PER_M_S, 1000.0]).astype(np.float32)
        return Driven(done, drive.poses(), drive.rows(), guard.last, ended, seconds)


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
