"""What all chains of servos have in common, however wired: what a servo says, what it must keep, what a driver can do."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from bns.hardware.servos.servo_table import ServoTable
from bns.hardware.stop import Stop


class ServoError(Exception):
    """A servo that does not answer, or answers with an alarm."""


class ServoAlarmError(ServoError):
    """A servo that answers, with an alarm."""

    def __init__(self, number: int, alarm: str) -> None:
        super().__init__(f"servo {number}: {alarm}; fix the cause, then switch the servos off and on")


class StuckServoError(ServoError):
    """A servo that has been at the limit of its torque for too long: something holds its joint, most often the body itself."""

    def __init__(self, number: int, load: float, lasted_s: float) -> None:
        super().__init__(f"servo {number} has used {load:.0%} of its torque for {lasted_s:.1f} s; is it stuck?")
        self.number = number


class RestartedServoError(ServoError):
    """A servo that works without the torque that it was given: it restarted, most often because its supply dipped."""

    def __init__(self, number: int, lost: str) -> None:
        super().__init__(
            f"servo {number} has restarted: {lost}. Its supply dipped: check plugs, cables and what current the supply can give"
        )


@dataclass(frozen=True)
class Health:
    """What a servo says of itself; load is a share of the highest torque, with the sign of its direction."""

    position_rad: float
    load: float
    voltage_v: float
    temperature_c: float


def narrow(number: int, limits: tuple[int, int], table: ServoTable, reach_rad: float) -> str:
    """What is wrong with a servo's angle limits where its joint is to reach so far to both sides, or nothing.

    With both at 0, an AX-12 is in wheel mode: it takes a speed for its motor's power, and turns without end.
    """
    low, high = limits
    if low == high == 0 and table.protocol == 1:
        return f"servo {number} is in wheel mode: both its angle limits are 0, so it would turn without end"
    reach = reach_rad / table.rad_per_step
    if low <= table.centre - reach and high >= table.centre + reach - 1:
        return ""
    least, most = math.floor(table.centre - reach), math.ceil(table.centre + reach - 1)
    needs = f"a gait needs {least} to {most}, {math.degrees(reach_rad):.0f}° to both sides"
    return f"servo {number} has the angle limits {low} to {high}; {needs}"


@dataclass(frozen=True)
class ServoLimits:
    """What a servo must keep while it works; `torque` is the share of the highest that it is given, `load` of that one.

    The makers allow 12 V; half a volt more is for the servo's own reading and for a battery that has just been charged.
    A servo at that load for `stalled_s` does not follow any more; for `stuck_s`, it has to be stopped.
    """

    temperature_c: float = 65.0
    low_v: float = 9.0
    high_v: float = 12.5
    load: float = 0.95
    torque: float = 0.8
    stalled_s: float = 0.25
    stuck_s: float = 1.0

    def check(self, found: Mapping[int, Health]) -> None:
        """ServoError if a servo is too hot, or has too much or too little voltage."""
        for number, health in found.items():
            if health.temperature_c > self.temperature_c:
                raise ServoError(f"servo {number} is at {health.temperature_c:.0f} °C; let it cool below {self.temperature_c:g}")
            if not self.low_v <= health.voltage_v <= self.high_v:
                allowed = f"{self.low_v:g} to {self.high_v:g}"
                raise ServoError(f"servo {number} has {health.voltage_v:.1f} V, not {allowed}; check the supply")


class ServoChain(Protocol):
    """A driver of a chain: servos in the order of the joints."""

    retries: int
    limits: ServoLimits
    step_rad: float
    """The smallest change of an angle."""

    def arm(self, meanwhile: Callable[[], object] = lambda: None) -> None:
        """Torque on without a jerk: goals are where the joints are, and the torque grows in steps to its limit.

        `meanwhile` is called at least every 0.1 s of that; what it raises ends it.
        """

    def move(self, angles_rad: Sequence[float], speeds_rad_s: Sequence[float]) -> list[float]:
        """Set goals and speeds of all joints; the angles really sent, after clipping, once all confirmed them."""

    def health(self) -> Mapping[int, Health]:
        """What every servo says, in the order of the joints; ServoError if one reports an alarm or is beyond its limits.

        From `arm` to `stop` also if one has lost its torque, as far as that takes few questions: `check_torque` asks all.
        """

    def check_torque(self) -> None:
        """ServoError if a servo has lost the torque that it was given."""

    def stop(self, patience_s: float = 5.0) -> Stop:
        """Torque off, confirmed by every servo. Never raises."""

    def close(self) -> None:
        """Give the port free."""


class StrainWatch:
    """How long each servo has been at the limit of its torque, from one look to the next."""

    def __init__(self, limits: ServoLimits) -> None:
        self._limits = limits
        self._since_s: dict[int, float] = {}
        self.stalled = False
        """Whether a servo did not follow any more since this was last set to False."""

    def look(self, found: Mapping[int, Health], now_s: float) -> None:
        """Take in what the servos say; StuckServoError if one has been stuck for too long."""
        strained = [n for n, health in found.items() if abs(health.load) > self._limits.load * self._limits.torque]
        self._since_s = {number: self._since_s.get(number, now_s) for number in strained}
        for number, since_s in self._since_s.items():
            lasted_s = now_s - since_s
            self.stalled |= lasted_s > self._limits.stalled_s
            if lasted_s > self._limits.stuck_s:
                raise StuckServoError(number, abs(found[number].load), lasted_s)
