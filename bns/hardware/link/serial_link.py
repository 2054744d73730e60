"""A serial port that is asked and answers, line by line, over pyserial."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.clock import Clock
from bns.hardware.guard.holder import holder_text
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.link.reply_time import GRANULARITY_S, ReplyLimits, ReplyTime
from bns.hardware.link.terminal_error import TerminalError

with extra("robot"):
    import serial
    from serial.tools.list_ports import comports

_LONGEST_LINE = 256
_OWED_S = 3.0
"""An answer that has not come after so long was lost."""


class NoReplyError(Exception):
    """Nothing came back in time, or the port is gone; the driver decides what that means."""


class SerialLink:
    """Asks with a line, takes the line that comes back. One exchange at a time.

    A port that vanishes (a Bluetooth link that breaks) is opened again at the next exchange. `times` is how long answers take.
    """

    def __init__(
        self, port: str, baud: int, clock: Clock, journal: HardwareLog, limits: ReplyLimits | None = None
    ) -> None:
        self.port, self._baud, self._clock, self._journal = port, baud, clock, journal
        self.times = ReplyTime(limits)
        self._owed: list[tuple[float, bytes]] = []
        """When questions were asked whose answers have not come and may still do so."""
        self._twice: list[tuple[float, bytes]] = []
        """Likewise, of questions that were asked more than once and have been answered once."""
        self._serial: serial.Serial | None = None
        self._serial = open_port(port, baud, clock)

    def exchange(self, request: bytes, timeout_s: float, again: bool = False) -> bytes:
        """Send `request`, return the line that answers without its end; NoReplyError if none does within `timeout_s`.

        Answers begin with the letter of their question, in lower case. One to an older question is passed over, but a question
        asked `again` may be answered by what is on its way since it was asked before. A question that comes back is an echo.
        """
        began_s = self._clock.now_s()
        for late in (self._owed, self._twice):
            late[:] = [(asked_s, what) for asked_s, what in late if began_s - asked_s < _OWED_S]
        try:
            if self._serial is None:
                self._serial, self._owed, self._twice = open_port(self.port, self._baud, self._clock), [], []
            if not again:
                self.forget()
            self._journal.note("sent", data=request.decode("latin-1"))
            in_vain = self._clock.in_vain(timeout_s)
            self._serial.write(request)
            line = self._line(in_vain)
            while self._is_echo(line, request) or self._is_older(line, request, began_s):
                self._journal.note("passed-over", data=line.decode("latin-1"))
                line = self._line(in_vain)
        except (serial.SerialException, OSError, TerminalError, HardwareError) as error:
            self._lose(error)
            self._wait_out(began_s + timeout_s)
            raise NoReplyError(f"the port {self.port} is gone ({error})") from error
        self._journal.note("received", data=line.decode("latin-1"))
        took_s = self._clock.now_s() - began_s
        if not line.endswith(b"\n"):
            self._owed.append((began_s, request))
            self._wait_out(began_s + timeout_s)
            raise NoReplyError(f"no answer to {request!r} within {timeout_s:.2g} s")
        if not any(what == request for _, what in self._owed):  # else nobody knows which one was answered
            self.times.measured(took_s)
        self._twice += [pair for pair in self._owed if pair[1] == request]
        self._owed = [pair for pair in self._owed if pair[1] != request]
        return line.strip(b"\r\n")

    def _is_echo(self, line: bytes, request: bytes) -> bool:
        """Whether a line is what was asked, now or before: some adapters hand back what they send."""
        asked = (request, *(what for _, what in (*self._owed, *self._twice)))
        return line.endswith(b"\n") and any(line.strip(b"\r\n") == what.strip(b"\r\n") for what in asked)

    def _is_older(self, line: bytes, request: bytes, began_s: float) -> bool:
        """Whether a line answers a question from before: another letter, or the same one sooner than any answer has ever come."""
        older = [pair for pair in (*self._owed, *self._twice) if pair[1] != request and pair[1][:1].lower() == line[:1]]
        too_soon = self._clock.now_s() - began_s < 0.5 * self.times.quickest_s
        if not older or (line[:1] == request[:1].lower() and not too_soon):
            return False
        (self._owed if older[0] in self._owed else self._twice).remove(older[0])
        return True

    def forget(self) -> None:
        """Drop answers that came too late."""
        with suppress(serial.SerialException, OSError, TerminalError):  # then there are none
            if self._serial is not None:
                self._serial.reset_input_buffer()

    def _line(self, in_vain: Callable[[], bool]) -> bytes:
        assert self._serial is not None
        line = bytes(self._serial.read_until(b"\n", _LONGEST_LINE))
        while not line.endswith(b"\n") and len(line) < _LONGEST_LINE and not in_vain():
            line += self._serial.read_until(b"\n", _LONGEST_LINE)
        return line

    def _wait_out(self, until_s: float) -> None:
        self._clock.waited(until_s - self._clock.now_s())

    def _lose(self, error: Exception) -> None:
        if self._serial is not None:  # else it was gone before
            self._journal.note("link-lost", port=self.port, error=str(error))
        self.close()

    def close(self) -> None:
        """Give the port free."""
        if self._serial is not None:
            port, self._serial = self._serial, None
            port.close()


def open_port(port: str, baud: int, clock: Clock) -> serial.Serial:
    """An open port; HardwareError says why there is none and what to try."""
    if not Path(port).exists():
        raise HardwareError(no_port(port))
    try:
        return serial.Serial(port, baud, timeout=GRANULARITY_S, write_timeout=clock.longest_write_s, exclusive=True)
    except serial.SerialException as error:
        raise HardwareError(why_not_opened(port, error)) from error


def no_port(port: str) -> str:
    """That there is no such port, and which there are."""
    return f"there is no port {port}. {_ports_there_are()} Try: bns doctor"


def why_not_opened(port: str, error: OSError) -> str:
    """Why a port that is there cannot be opened, and what to try."""
    if error.errno in {errno.EMFILE, errno.ENFILE}:  # before whatever would open a file to find out more
        return f"{port} cannot be opened: too many files are open already. End other programs, or allow more (ulimit -n)."
    if error.errno == errno.EACCES or not os.access(port, os.R_OK | os.W_OK):
        return (
            f"no permission to use {port}. Add yourself to the group that owns it (often dialout: "
            "sudo usermod -aG dialout $USER), log in again."
        )
    if error.errno in {errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK}:
        other = f"{port} is in use by another program (ModemManager, a terminal, another trial). End that one first."
        return holder_text(port) or other
    return f"{port} cannot be opened: {error}. Is it a serial port, and is the robot paired? Try: bns doctor"


def _ports_there_are() -> str:
    found = sorted(p.device for p in comports()) + sorted(str(p) for p in Path("/dev").glob("rfcomm*"))
    return f"Ports there are: {', '.join(found)}." if found else "No serial port was found; is it plugged in or paired?"
