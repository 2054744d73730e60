"""A pseudo-terminal with an emulated device at its far end: what opens the near end cannot tell it from a serial port."""

from __future__ import annotations

import contextlib
import os
import re
import select
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, Self

from bns.hardware.clock import EmulatedClock

_QUIET_S = 0.05  # by the computer's clock; after so long without a change, what is not there was read already
_LONGEST_TURN_S = 30.0  # likewise; a pump that takes longer to come round hangs


class Device(Protocol):
    """The far end of a serial line."""

    def receive(self, data: bytes) -> bytes:
        """Take bytes in, give the bytes that answer (none: silence)."""

    def written(self) -> None:
        """The answer is on the line."""


def put_through(master: int, slave: int, data: bytes) -> None:
    """Write, and wait until it is at the other end: the kernel takes its time for that, emulated time would not wait.

    Somebody who reads meanwhile takes away what has come; then nothing new for a while says that all of it was there.
    """
    before, came = _waiting(slave), 0
    os.write(master, data)
    quiet_s = (now_s := time.monotonic()) + _QUIET_S
    while came < len(data) and now_s < quiet_s:
        time.sleep(0)
        here, now_s = _waiting(slave), time.monotonic()
        quiet_s, came, before = (quiet_s if here == before else now_s + _QUIET_S), came + max(here - before, 0), here


def _waiting(slave: int) -> int:
    import fcntl  # noqa: PLC0415  # Windows has neither
    import termios  # noqa: PLC0415

    return int.from_bytes(fcntl.ioctl(slave, termios.FIONREAD, bytes(4)), sys.byteorder)


class PseudoTerminal:
    """Pumps bytes between a port and a device, in a thread of its own, while it is open.

    The near end is kept open here as well: drivers close and reopen ports (`setBaudRate` does), and the line must outlive that.
    `path` is a link that follows the line when it is cut and plugged in again.
    """

    def __init__(self, device: Device, folder: Path, name: str) -> None:
        self.path = folder / name
        self._device = device
        self._wake_read, self._wake_write = os.pipe()
        self._lock = threading.RLock()
        self._came_round = threading.Condition()
        self._plugged = self._watched = 0
        """How many lines there have been, and which of them the pump is at; it looks for another one in between."""
        self._master = self._slave = -1
        self._open = True
        self._thread = threading.Thread(target=self._pump, name=f"emulated {name}", daemon=True)
        self._thread.start()
        self.plug_in()

    def plug_in(self) -> None:
        """A new line in the place of the one that was cut; the pump waits at it when this returns.

        Else a busy computer would let the next question wait for an answer that the last one, on the dead line, is owed.
        """
        with self._lock:
            self.cut()
            import tty  # noqa: PLC0415  # Windows has no pseudo-terminals

            self._master, self._slave = os.openpty()
            tty.setraw(self._slave)
            os.set_blocking(self._master, False)  # a host that does not read must not stop the pump
            self.path.unlink(missing_ok=True)
            self.path.symlink_to(os.ttyname(self._slave))
            self._plugged = number = self._plugged + 1
        self._wake()
        if threading.current_thread() is not self._thread:
            with self._came_round:
                self._came_round.wait_for(lambda: self._watched >= number, _LONGEST_TURN_S)

    def send(self, data: bytes) -> None:
        """What the device says unasked; it can be read at the near end when this returns."""
        with contextlib.suppress(OSError):
            with self._lock:
                if self._master < 0:
                    return
                line = os.dup(self._master), os.dup(self._slave)  # it may be cut while the bytes are on their way
            try:
                put_through(*line, data)
            finally:
                for end in line:
                    os.close(end)

    def baud(self) -> int | None:
        """The rate that the host has set its end to; None if the system does not say, or the line is dead."""
        import termios  # noqa: PLC0415  # Windows has none

        with self._lock:
            if self._master < 0:
                return None
            code = termios.tcgetattr(self._master)[5]
        names = [name for name in dir(termios) if re.fullmatch(r"B\d+", name) and getattr(termios, name) == code]
        return int(names[0][1:]) if names else None

    def cut(self) -> None:
        """The line goes dead, as when a Bluetooth link breaks; the device knows nothing of it."""
        with self._lock:
            if self._master < 0:
                return
            self.path.unlink(missing_ok=True)
            os.close(self._master)
            os.close(self._slave)
            self._master = self._slave = -1

    def close(self) -> None:
        """End the pump and give everything free."""
        self._open = False
        self._wake()
        self._thread.join(timeout=5)
        self.cut()
        os.close(self._wake_read)
        os.close(self._wake_write)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def _wake(self) -> None:
        os.write(self._wake_write, b"w")

    def _pump(self) -> None:
        while self._open:
            with self._lock:
                line, number = self._master, self._plugged
            with self._came_round:
                self._watched = number
                self._came_round.notify_all()
            for ready in self._ready(line):
                if ready == self._wake_read:
                    os.read(self._wake_read, 64)
                else:
                    self._serve(line)

    def _ready(self, line: int) -> list[int]:
        watched = [self._wake_read] + ([line] if line >= 0 else [])
        try:
            return select.select(watched, [], [], 0.2)[0]
        except (OSError, ValueError):  # the line was cut meanwhile
            return []

    def _serve(self, line: int) -> None:
        try:
            data = os.read(line, 4096)
        except OSError:
            return
        answer = self._device.receive(data)
        with self._lock, contextlib.suppress(OSError):
            if answer and line == self._master:
                os.write(line, answer)
                self._device.written()


class HangUp:
    """Cuts a line, and plugs it in again when the time has come."""

    def __init__(
        self, line: PseudoTerminal, clock: EmulatedClock, plugged_in: Callable[[], None] = lambda: None
    ) -> None:
        self._line, self._clock, self._plugged_in = line, clock, plugged_in
        self._until_s: float | None = None
        clock.listeners.append(self._moved_on)

    def cut(self, for_s: float) -> None:
        """The line is dead for so long."""
        self._line.cut()
        self._until_s = self._clock.now_s() + for_s

    def close(self) -> None:
        """No more."""
        self._clock.listeners.remove(self._moved_on)

    def _moved_on(self, now_s: float) -> None:
        if self._until_s is not None and now_s >= self._until_s:
            self._until_s = None
            self._plugged_in()
            self._line.plug_in()
