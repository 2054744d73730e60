"""Khepera III over its ASCII protocol: speeds, encoders, battery, and a stop that is confirmed by reading back.

The robot has no watchdog: its last speed goes on when the link dies. So every speed is acknowledged, and `stop` returns only
with what the robot itself said about its wheels.
"""

from __future__ import annotations

import math
import re
from dataclasses import asdict, dataclass
from typing import Protocol

from bns.errors import HardwareError
from bns.hardware.clock import Clock
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.link.reply_time import ReplyTime
from bns.hardware.link.serial_link import NoReplyError
from bns.hardware.stop import Stop
from bns.hardware.wheels.wheel_drive import RobotLostError
from bns.hardware.wheels.wheeled import flat_text

BAUD = 115200
ATTEMPTS = 4
"""After so many answers that make no sense the robot counts as lost; after none, when the link's patience is over."""
STILL_M_S = 0.005
"""A wheel slower than this stands still: three quanta of the speed reading, and less than half a millimetre to coast."""
_READINGS = 2
"""The protocol has no checksum: one reading can be garbled into a zero, two in a row hardly."""
_OBEYS_S = 0.2
"""An order to stop that shows no effect for so long is given again."""
_SILENT_S = 0.5
"""A robot that has answered so lately is no lost link, whatever its last question came to."""
WHEELBASE_M = 0.0884
"""Between the wheels, published."""
LOWEST_UNITS, HIGHEST_UNITS = 2_000, 43_000
"""Ends of the range that the firmware regulates; that of firmware 3 and later is not published."""
FLAT_V = 6.0
_MARK_PULSES = 5_000_000
"""150 m and more: further than a drive goes, and far from where counters of 32 bits begin again."""
_SPEEDS = r"e,(-?\d+),(-?\d+)"


class _NonsenseError(NoReplyError):
    """Something came back, but no answer to what was asked."""


class Exchange(Protocol):
    """What the driver asks of a link."""

    times: ReplyTime

    def exchange(self, request: bytes, timeout_s: float, again: bool = False) -> bytes:
        """The line that answers; NoReplyError if none does in that time. `again`: one to what was asked before will do."""

    def close(self) -> None:
        """Give it free."""


@dataclass(frozen=True)
class Firmware:
    """What differs between firmwares: units of speed for one metre per second, metres for one encoder pulse."""

    version: int
    revision: int
    units_per_m_s: float
    m_per_pulse: float


def firmware(version: int, revision: int) -> Firmware:
    """Scales of a firmware, by its answer to `B`."""
    if version < 3:
        return Firmware(version, revision, 144_010.0, 0.1288 / 2764)
    return Firmware(version, revision, 218_720.0, 0.03068e-3)


class KheperaIII:
    """Driver. Opening asks for the firmware and the battery and makes sure that the wheels stand still."""

    counts_from_its_start = True
    """Its counters of the wheels' ways are at zero when it starts, so that it is found to have restarted."""

    def __init__(self, link: Exchange, clock: Clock, journal: HardwareLog, stop_s: float = 5.0) -> None:
        self._link, self._clock, self._journal, self._stop_s = link, clock, journal, stop_s
        self.retries = 0
        self.firmware = self._identified()

    def _identified(self) -> Firmware:
        try:
            return firmware(*(int(n) for n in self._ask(b"B", r"b,(\d+),(\d+)")))
        except RobotLostError as error:
            raise HardwareError(
                f"no Khepera III answers ({error}). Is it switched on, paired (PIN 0000), and the port at {BAUD} baud?"
            ) from error

    @property
    def least_m_s(self) -> float:
        """The lowest speed that the firmware regulates; 0: not known."""
        return LOWEST_UNITS / self.firmware.units_per_m_s if self.firmware.version < 3 else 0.0

    def set_speed_m_s(self, left: float, right: float) -> tuple[float, float]:
        """Set the speeds of the wheels' surfaces, m/s; what was really sent, after clipping and rounding."""
        scale = self.firmware.units_per_m_s
        units = [max(-HIGHEST_UNITS, min(HIGHEST_UNITS, round(v * scale))) for v in (left, right)]
        self._ask(b"D,l%d,l%d" % tuple(units), "d")
        return units[0] / scale, units[1] / scale

    def close(self) -> None:
        """Give the link free."""
        self._link.close()

    def speed_m_s(self) -> tuple[float, float]:
        """Speeds of the wheels' surfaces as the robot measures them, m/s."""
        left, right = self._ask(b"E", _SPEEDS)
        return int(left) / self.firmware.units_per_m_s, int(right) / self.firmware.units_per_m_s

    def encoders_m(self) -> tuple[float, float]:
        """Way of the wheels' surfaces since the counters were last set, m."""
        left, right = self._ask(b"R", r"r,(-?\d+),(-?\d+)")
        return int(left) * self.firmware.m_per_pulse, int(right) * self.firmware.m_per_pulse

    def mark_encoders(self) -> None:
        """Set the counters far from zero, where they begin again when it restarts."""
        self._ask(b"I,l%d,l%d" % (_MARK_PULSES, _MARK_PULSES), "i")

    def battery_v(self) -> float:
        """Voltage of the battery."""
        whole, fraction = self._ask(b"V,0", r"v,(\d+),(\d+)")
        return float(f"{whole}.{fraction:0>4}")

    def stop(self, patience_s: float | None = None) -> Stop:
        """Set both speeds to zero until the robot acknowledges it and reads back still wheels; what came of it. Never raises.

        Nothing is waited for but answers, and for these no longer than this link makes necessary: one that comes later than that
        still counts. Once acknowledged, the order is given again only if the wheels go on turning: what is lost on the way back
        takes nothing away from it. It is tried for `patience_s`, or as long as the rig says, while the journal's disk lets it.
        """
        began_s, acknowledged_s, ordered_s, still = self._clock.now_s(), None, -math.inf, 0
        turned_s, problem = -math.inf, "one reading of still wheels is none"
        patience_s = (self._stop_s if patience_s is None else patience_s) - self._journal.held_up_s
        while True:
            timeout_s = self._link.times.timeout_s
            try:
                if self._clock.now_s() - ordered_s > max(_OBEYS_S, 2.0 * timeout_s):
                    self._once(b"D,l0,l0", "d", timeout_s, again=True)
                    ordered_s = self._clock.now_s()
                    acknowledged_s = acknowledged_s or ordered_s - began_s
                still = still + 1 if self._stands(timeout_s) else 0
                turned_s = turned_s if still else self._clock.now_s()
            except NoReplyError as error:
                problem = str(error)
            lasted_s = self._clock.now_s() - began_s
            if self._clock.now_s() - turned_s < _SILENT_S:
                problem = "the wheels still turn"
            if still == _READINGS:
                return self._stopped(Stop(True, lasted_s, acknowledged_s))
            if lasted_s > patience_s + self._journal.held_up_s:
                return self._stopped(Stop(False, lasted_s, acknowledged_s, problem))

    def _stands(self, timeout_s: float) -> bool:
        speeds = (int(v) / self.firmware.units_per_m_s for v in self._once(b"E", _SPEEDS, timeout_s, again=True))
        return max(abs(v) for v in speeds) <= STILL_M_S

    def _stopped(self, stop: Stop) -> Stop:
        self._journal.note("stop", **asdict(stop))
        return stop

    def _ask(self, command: bytes, answer: str) -> tuple[str, ...]:
        """The groups of the robot's answer; asked again when nothing or nonsense comes back."""
        problem, times, began_s, attempt, nonsense = "", self._link.times, self._clock.now_s(), 0, 0
        patience_s = times.patience_s
        while nonsense < ATTEMPTS and (left_s := began_s + patience_s - self._clock.now_s()) > 0:
            self.retries += attempt > 0
            try:
                return self._once(command, answer, min(times.timeout_s * 2**attempt, left_s), attempt > 0)
            except NoReplyError as error:
                problem, attempt, nonsense = str(error), attempt + 1, nonsense + isinstance(error, _NonsenseError)
        raise RobotLostError(f"{problem}; asked {attempt} times in {self._clock.now_s() - began_s:.1f} s")

    def _once(self, command: bytes, answer: str, timeout_s: float, again: bool = False) -> tuple[str, ...]:
        line = self._link.exchange(command + b"\n", timeout_s, again).decode("latin-1").strip()
        match = re.fullmatch(answer, line)
        if match is None:
            raise _NonsenseError(f"the answer to {command.decode()} was {line!r}")
        return match.groups()


def check_battery(volts: float) -> None:
    """HardwareError if the battery is too low to begin with."""
    if volts < FLAT_V:
        raise HardwareError(flat_text(volts, FLAT_V))
