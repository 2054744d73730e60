"""A Khepera III at the level of bytes: what its serial server answers, with its quirks, its clock and its faults.

Quirks kept: a number without its type letter loses its first character; nothing answers a fault of the inner bus; there is no
watchdog, so the last speed goes on when nobody speaks any more; speeds are read back in coarse steps.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable

from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.body import SPEED_OVER_S, DifferentialBody
from bns.hardware.emulators.faults import Faults
from bns.hardware.wheels.khepera import HIGHEST_UNITS, Firmware

_LONGEST_LINE, _MOST_ARGUMENTS, _LONGEST_ARGUMENT = 82, 4, 9
_QUANTUM_SHARE = 53 / 30000  # of the highest commanded speed; the reading comes in whole steps of it
_LATE_S = 0.15


class KheperaEmulator:
    """The device at the far end of a line. `cut_line` breaks the link for some seconds."""

    def __init__(
        self,
        body: DifferentialBody,
        clock: EmulatedClock,
        firmware: Firmware,
        faults: Faults | None = None,
        latency_s: float = 0.02,
        battery_v: float = 7.9,
    ) -> None:
        self.body, self._clock, self._firmware = body, clock, firmware
        self._faults = faults or Faults()
        self._latency_s, self._full_v = latency_s, battery_v
        self._buffer, self._silent_until_s, self._endless = b"", -1.0, False
        self._encoders_m = [0.0, 0.0]
        self._encoders_at_s = clock.now_s()
        self._lock = threading.Lock()
        self.cut_line: Callable[[float], None] = lambda _seconds: None
        self._answers: dict[str, Callable[[list[int]], str]] = {
            "B": lambda _a: f"b,{firmware.version},{firmware.revision}",
            "D": self._drive,
            "E": lambda _a: "e,{},{}".format(*self._speed_units()),
            "R": lambda _a: "r,{},{}".format(*self._pulses()),
            "I": self._set_encoders,
            "M": lambda _a: "m",
            "H": lambda _a: "h",
            "N": lambda _a: "n," + ",".join("0" for _ in range(11)) + f",{round(1000 * clock.now_s())}",
            "O": lambda _a: "o," + ",".join("4000" for _ in range(11)) + f",{round(1000 * clock.now_s())}",
            "V": self._battery,
        }

    def receive(self, data: bytes) -> bytes:
        """Bytes in, bytes out; commands end with CR or LF."""
        with self._lock:
            self._buffer = (self._buffer + data)[-4 * _LONGEST_LINE :]
            *lines, self._buffer = re.split(rb"[\r\n]", self._buffer)
            return b"".join(self._answer(line) for line in lines if line)

    def written(self) -> None:
        """The answer is on the line; one whose end was garbled is waited for in vain."""
        if self._endless:
            self._endless = False
            self._clock.fell_silent()

    def _answer(self, line: bytes) -> bytes:
        now_s = self._clock.now_s()
        if self._faults.strikes("brown-out", now_s):
            self._brown_out(now_s)
        if self._faults.strikes("hang-up", now_s):
            self.cut_line(self._faults.length_s("hang-up"))
            return self._nothing()
        deaf = self._faults.strikes("lost-request", now_s) or self._faults.strikes("bus-fault", now_s)
        if deaf or now_s < self._silent_until_s:
            return self._nothing()
        self._clock.sleep(self._latency_s / 2)  # as long there as back
        answer = self._carried_out(line.decode("latin-1")).encode() + b"\r\n"
        self._clock.sleep((_LATE_S if self._faults.strikes("late-reply", now_s) else self._latency_s) - self._latency_s / 2)
        if self._faults.strikes("lost-reply", now_s):
            return self._nothing()
        if self._faults.strikes("corrupt-reply", now_s):
            answer = self._faults.byte(answer)
            self._endless = not answer.endswith(b"\n")
        return answer

    def _nothing(self) -> bytes:
        self._clock.fell_silent()
        return b""

    def _carried_out(self, line: str) -> str:
        letter, *arguments = line.split(",")
        too_long = len(line) > _LONGEST_LINE or any(len(a) > _LONGEST_ARGUMENT for a in arguments)
        if letter not in self._answers or too_long or len(arguments) > _MOST_ARGUMENTS:
            return "$"
        try:
            # The first character of a number tells its type and is never read as part of it.
            numbers = [int(a[1:] or "0") if letter != "V" else int(a) for a in arguments]
            return self._answers[letter](numbers)
        except (ValueError, IndexError):
            return "$"

    def _drive(self, units: list[int]) -> str:
        left, right = (max(-HIGHEST_UNITS, min(HIGHEST_UNITS, u)) / self._firmware.units_per_m_s for u in units[:2])
        self._count_encoders()
        self.body.order(left, right, self._clock.now_s())
        return "d"

    def _speed_units(self) -> tuple[int, int]:
        quantum = _QUANTUM_SHARE * 30000
        left, right = self.body.wheel_speeds_m_s(self._clock.now_s())
        scale = self._firmware.units_per_m_s / quantum
        return round(round(left * scale) * quantum), round(round(right * scale) * quantum)

    def _count_encoders(self) -> None:
        now_s = self._clock.now_s()
        steps = max(1, round((now_s - self._encoders_at_s) / 0.02))
        width_s = (now_s - self._encoders_at_s) / steps
        for i in range(steps):
            speeds = self.body.wheel_speeds_m_s(self._encoders_at_s + (i + 0.5) * width_s + SPEED_OVER_S / 2)
            self._encoders_m = [m + v * width_s for m, v in zip(self._encoders_m, speeds, strict=True)]
        self._encoders_at_s = now_s

    def _pulses(self) -> tuple[int, int]:
        self._count_encoders()
        left, right = (round(m / self._firmware.m_per_pulse) for m in self._encoders_m)
        return left, right

    def _set_encoders(self, pulses: list[int]) -> str:
        self._encoders_m = [p * self._firmware.m_per_pulse for p in (pulses[0], pulses[1])]
        self._encoders_at_s = self._clock.now_s()
        return "i"

    def _battery(self, which: list[int]) -> str:
        volts = max(self._full_v - self._clock.now_s() * 1e-4, 0.0)
        readings = {0: volts, 1: 0.21, 3: 1.05, 4: 27.5, 5: 78.0}
        value = readings.get(which[0], 0.0)
        return "v,{},{:04d}".format(*divmod(round(10000 * value), 10000))

    def _brown_out(self, now_s: float) -> None:
        if now_s >= self._silent_until_s:
            self._set_encoders([0, 0])
            self.body.order(0.0, 0.0, now_s)
            self._silent_until_s = now_s + self._faults.length_s("brown-out")
