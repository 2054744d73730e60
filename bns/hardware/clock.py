"""The time that a trial runs on: the world's, or an emulated one that can be sped up.

An emulated trial is exact at any speed: its clock moves on only by what somebody waits for, whatever the machine does meanwhile.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Protocol

_SMALLEST_SLEEP_S = 0.002  # shorter ones cost more than they last, so they are saved up
_LONGEST_ANSWER_S = 3.0  # an emulator that takes longer by the computer's clock will not answer


class Clock(Protocol):
    """What drivers and trackers ask for the time.

    ``longest_write_s``: a port that takes no bytes for so long, by the computer's clock, is hung.
    """

    longest_write_s: float

    def now_s(self) -> float:
        """Seconds since some fixed instant."""

    def sleep(self, seconds: float) -> None:
        """Let time pass."""

    def waited(self, seconds: float) -> None:
        """Somebody waited this long in vain (for bytes, say) by the computer's own clock."""

    def in_vain(self, seconds: float) -> Callable[[], bool]:
        """Begin to wait for an answer; call what is returned to learn whether it is in vain to wait on."""

    def arrived(self) -> None:
        """Something that comes unasked (a frame) has come."""


class RealClock:
    """The computer's steady clock."""

    longest_write_s = 1.0

    def now_s(self) -> float:
        """Seconds of the steady clock."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(max(seconds, 0.0))

    def waited(self, seconds: float) -> None:
        """Nothing to do: the time has passed by itself."""

    def in_vain(self, seconds: float) -> Callable[[], bool]:
        """After that time."""
        end_s = self.now_s() + seconds
        return lambda: self.now_s() > end_s

    def arrived(self) -> None:
        """Nothing to do."""


class EmulatedClock:
    """Time that passes only when somebody waits; `speed` seconds of it pass in one of the computer's (inf: at once)."""

    longest_write_s = 20.0  # a busy computer is no lost link

    def __init__(self, speed: float = 1.0) -> None:
        self.speed = speed
        self._now_s, self._owed_s = 0.0, 0.0
        self._silences = 0
        self._lock = threading.Lock()
        self.arrivals = threading.Condition()
        """Notified of everything that `arrived`; `arrived_count` is how much that was."""
        self.arrived_count = 0
        self.listeners: list[Callable[[float], None]] = []
        """Emulated devices that act by themselves as time goes on; called with the new time."""

    def now_s(self) -> float:
        """Emulated seconds since the start."""
        with self._lock:
            return self._now_s

    def sleep(self, seconds: float) -> None:
        """Move on, and sleep for the share of it that the speed leaves."""
        with self._lock:
            self._now_s += max(seconds, 0.0)
            self._owed_s += max(seconds, 0.0) / self.speed
            owed_s = self._owed_s
            if owed_s >= _SMALLEST_SLEEP_S:
                self._owed_s = 0.0
        if owed_s >= _SMALLEST_SLEEP_S:
            time.sleep(owed_s)
        self._tell()

    def waited(self, seconds: float) -> None:
        """Move on: what was waited for did not come."""
        with self._lock:
            self._now_s += max(seconds, 0.0)
        self._tell()

    def _tell(self) -> None:
        now_s = self.now_s()
        for listener in tuple(self.listeners):
            listener(now_s)

    def in_vain(self, seconds: float) -> Callable[[], bool]:
        """When an emulated device has let it be known that it will not answer: a busy computer is no lost answer."""
        before, end_s = self._silences, time.monotonic() + _LONGEST_ANSWER_S
        return lambda: self._silences != before or time.monotonic() > end_s

    def fell_silent(self) -> None:
        """An emulated device heard something and will not answer it."""
        with self._lock:
            self._silences += 1

    def arrived(self) -> None:
        """Let an emulated device know that what it sent was taken: time goes on only then."""
        with self.arrivals:
            self.arrived_count += 1
            self.arrivals.notify_all()
