"""A snake of servos on its rig: cycles driven posture by posture, watched, and stopped."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import numpy as np

from bns.errors import HardwareError, TrialPausedError
from bns.hardware.clock import Clock, EmulatedClock
from bns.hardware.delay import Motion
from bns.hardware.emulators.faults import FaultPlan
from bns.hardware.emulators.snake_rig import EmulatedSnakeRig
from bns.hardware.guard.recipe import StopRecipe, bridge_recipe, bus_recipe
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.platform import Driven
from bns.hardware.rig import Rig
from bns.hardware.safety import DriveEnded, Stopping, StopsAtTheEnd, Watch
from bns.hardware.servos.bending import bent
from bns.hardware.servos.bridge import BAUD as BRIDGE_BAUD
from bns.hardware.servos.bridge import BridgeChain
from bns.hardware.servos.dynamixel import DynamixelChain
from bns.hardware.servos.servo_chain import ServoChain, ServoError, StuckServoError
from bns.hardware.servos.snake_drive import KNOWN_S, UNKNOWN_S, SnakeDrive
from bns.hardware.servos.snake_settings import SnakeSettings, snake_settings
from bns.hardware.stop import Stop
from bns.hardware.tracking.eye import Eye
from bns.hardware.tracking.kinds import DELAY, checked, delay_of, open_tracker
from bns.physics.snake.gait import GREATEST_RAD, cycle_angles

REPEATS = 3
"""How often a trial drives its final controller by default: the dissertation drove it three times (section 5.7)."""
RIG = resources.files("bns.hardware") / "rigs" / "snake.yaml"


class SnakePlatform:
    """Implements `bns.hardware.platform.Platform`. Commands are cycles (n, 5), poses observations (n, 9) of the robot module."""

    def __init__(
        self,
        chain: ServoChain,
        eye: Eye,
        rig: Rig,
        settings: SnakeSettings,
        clock: Clock,
        journal: HardwareLog,
        stopping: Stopping,
    ) -> None:
        self._chain, self._eye, self._settings = chain, eye, settings
        self._clock, self._journal = clock, journal
        self._asked = lambda: stopping.reason
        self._watch, self._disagree_s = Watch(rig.limits, clock, stopping), rig.limits.disagree_s
        self._unknown_s = KNOWN_S if DELAY in rig.tracker else UNKNOWN_S

    @property
    def retries(self) -> int:
        """How often a question was asked again so far."""
        return self._chain.retries

    def pose(self) -> np.ndarray | None:
        """Middle between the markers and the direction from yellow to green."""
        sight = self._eye.standing()
        return None if sight is None else sight.pose

    def readings(self) -> dict[str, float]:
        """Lowest voltage and highest temperature of the servos."""
        try:
            found = self._chain.health().values()
        except ServoError as error:
            raise TrialPausedError(f"the servos are not fit to drive: {error}") from error
        return {"battery_v": min(h.voltage_v for h in found), "temperature_c": max(h.temperature_c for h in found)}

    def stop(self) -> Stop:
        """Torque off, confirmed."""
        return self._chain.stop()

    def close(self) -> None:
        """Give port and tracker free."""
        self._chain.close()
        self._eye.close()

    def _new_drive(self) -> SnakeDrive:
        return SnakeDrive(
            self._chain, self._eye, self._watch, self._settings, self._clock, self._journal, self._unknown_s, self._disagree_s
        )

    def move_about(self, seconds: float) -> Motion:
        """Bend to one side and back, for the tracker's delay; stopped at the end. TrialPausedError, StopNotConfirmedError."""
        drive = self._new_drive()
        self._watch.begin()
        with StopsAtTheEnd(self.stop, self._asked):
            try:
                drive.straighten()
                return bent(self._chain, self._eye, self._watch, self._settings, self._clock, seconds)
            except (ServoError, DriveEnded) as error:
                raise TrialPausedError(f"the robot could not be bent about: {error}") from error

    def lasts_s(self, commands: np.ndarray) -> float:
        """How long cycles take here, by the joints' speed and the pause after each posture; straightening not counted."""
        postures = [np.zeros(len(self._settings.ids))]
        for cycle in commands.astype(np.float64):
            postures += list(cycle_angles(cycle[:4], len(postures[0])))
        ways_rad = np.abs(np.diff(postures, axis=0)).max(axis=1)
        return float((ways_rad / self._settings.joint_speed_rad_s + self._settings.settle_s).sum())

    def drive(self, commands: np.ndarray) -> Driven:
        """Straighten the robot, then drive the cycles one after the other."""
        drive, ended = self._new_drive(), ""
        guard, stuck = StopsAtTheEnd(self.stop, self._asked), ""
        began_s = self._clock.now_s()
        self._watch.begin()
        with guard:
            try:
                drive.straighten()
                for cycle in commands.astype(np.float64):
                    drive.carry_out(cycle)
                drive.finish()
            except DriveEnded as end:
                ended = str(end)
            except ServoError as error:
                if not isinstance(error, StuckServoError) or not len(drive.done()):  # straightening is no gait
                    raise TrialPausedError(f"the servos failed: {error}") from error
                ended, stuck = str(error), f"servo {error.number}"
        assert guard.last is not None
        seconds = self._clock.now_s() - began_s
        leaps, spans_s = drive.leaps.count, drive.spans_s
        return Driven(drive.done(), drive.observed(), drive.rows, guard.last, ended, seconds, spans_s, stuck, leaps)


def open_chain(port: str, settings: SnakeSettings, clock: Clock, journal: HardwareLog) -> ServoChain:
    """The servos as a rig's settings say that they are wired; HardwareError names who is missing."""
    if settings.wiring == "bridge":
        return BridgeChain(port, len(settings.ids), clock, journal, settings.limits, GREATEST_RAD)
    return DynamixelChain(port, settings.ids, clock, journal, settings.limits, settings.table, GREATEST_RAD)


def open_platform(rig: Rig, clock: Clock, journal: HardwareLog, stopping: Stopping) -> SnakePlatform:
    """Open port and tracker, and make sure before anything else that the servos are limp, fit and all there."""
    settings = snake_settings(rig.driver)
    _check_tracker(rig)
    chain = open_chain(rig.port, settings, clock, journal)
    try:
        with StopsAtTheEnd(chain.stop):
            chain.health()
        eye = Eye(open_tracker(rig.tracker, clock), clock, journal, 0.0, delay_of(rig.tracker), rig.tracker["kind"])
    except ServoError as error:
        chain.close()
        raise HardwareError(f"the servos are not fit to drive: {error}. Fix this, then try again.") from error
    except BaseException:
        chain.close()
        raise
    return SnakePlatform(chain, eye, rig, settings, clock, journal, stopping)


def stop_recipe(rig: Rig) -> StopRecipe:
    """For the guard: torque off, by the wiring of the rig."""
    settings = snake_settings(rig.driver)
    if settings.wiring == "bridge":
        return bridge_recipe(BRIDGE_BAUD, len(settings.ids))
    return bus_recipe(settings.ids, settings.table)


def emulate(rig: Rig, folder: Path, clock: EmulatedClock, plan: FaultPlan, seed: int) -> EmulatedSnakeRig:
    """An emulated robot under an emulated camera, their ports in `folder`."""
    _check_tracker(rig)
    return EmulatedSnakeRig(rig, folder, clock, plan, seed)


def _check_tracker(rig: Rig) -> None:
    if rig.tracker["kind"] != "colour":
        raise HardwareError(
            f"the snake's ends are distinguished by colour; its tracker is {rig.tracker['kind']}, not kind: colour."
        )
    checked(rig.tracker)
