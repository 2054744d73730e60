"""A serial port that is asked and answers, line by line, over pyserial."""

from __future__ import annotations

import errno
import os
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.clock import Clock
from bns.hardware.hardware_log import HardwareLog
from bns.hardware.terminal_error import TerminalError

with extra("robot"):
    import serial
    from serial.tools.list_ports import comports

_LONGEST_LINE = 256
_SLICE_S = 0.01
_REMEMBERED = 20
"""Answers whose times say what is usual."""


class NoReplyError(Exception):
    """Nothing came back in time, or the port is gone; the driver decides what that means."""


class SerialLink:
    """Asks with a line, takes the line that comes back. One exchange at a time.

    A port that vanishes (a Bluetooth link that breaks) is opened again at the next exchange.
    """

    def __init__(self, port: str, baud: int, clock: Clock, journal: HardwareLog, timeout_s: float = 0.1) -> None:
        self.port, self._baud, self._clock, self._journal = port, baud, clock, journal
        self._timeout_s = timeout_s
        self._took_s: deque[float] = deque(maxlen=_REMEMBERED)
        self._serial: serial.Serial | None = None
        self._serial = open_port(port, baud)

    def exchange(self, request: bytes, hurry: bool = False) -> bytes:
        """Send `request`, return the line that answers without its end; NoReplyError if none does in the link's time-out.

        In `hurry` the time-out is what answers use to take, and one that was late for the question before is not thrown away.
        """
        began_s, timeout_s = self._clock.now_s(), self._usual_s if hurry else self._timeout_s
        try:
            if self._serial is None:
                self._serial = open_port(self.port, self._baud)
            if not hurry:
                self._serial.reset_input_buffer()  # an answer that came too late belongs to no question
            self._journal.note("sent", data=request.decode("latin-1"))
            in_vain = self._clock.in_vain(timeout_s)
            self._serial.write(request)
            line = self._line(in_vain)
        except (serial.SerialException, OSError, TerminalError, HardwareError) as error:
            self._lose(error)
            self._wait_out(began_s + timeout_s)
            raise NoReplyError(f"the port {self.port} is gone ({error})") from error
        self._journal.note("received", data=line.decode("latin-1"))
        took_s = self._clock.now_s() - began_s
        late = took_s > timeout_s + _SLICE_S and not hurry
        if late or not line.endswith(b"\n"):
            self._wait_out(began_s + timeout_s)
            raise NoReplyError(f"no answer to {request!r} within {timeout_s:.2g} s")
        if not hurry:
            self._took_s.append(took_s)
        return line.strip(b"\r\n")

    def forget(self) -> None:
        """Drop answers that came too late."""
        with suppress(serial.SerialException, OSError, TerminalError):  # then there are none
            if self._serial is not None:
                self._serial.reset_input_buffer()

    @property
    def _usual_s(self) -> float:
        """After so long an answer is later than all of the last were, by one look at the port."""
        return min(self._timeout_s, max(self._took_s, default=self._timeout_s) + _SLICE_S)

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


def open_port(port: str, baud: int) -> serial.Serial:
    """An open port; HardwareError says why there is none and what to try."""
    if not Path(port).exists():
        raise HardwareError(f"there is no port {port}. {_ports_there_are()} Try: bns doctor")
    try:
        return serial.Serial(port, baud, timeout=_SLICE_S, write_timeout=1.0, exclusive=True)
    except serial.SerialException as error:
        raise HardwareError(_why_not(port, error)) from error


def _why_not(port: str, error: serial.SerialException) -> str:
    if error.errno == errno.EACCES or not os.access(port, os.R_OK | os.W_OK):
        return (
            f"no permission to use {port}. Add yourself to the group that owns it (often dialout: "
            "sudo usermod -aG dialout $USER), log in again."
        )
    if error.errno in {errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK}:
        return f"{port} is in use by another program (ModemManager, a terminal, another trial). End that one first."
    return f"{port} cannot be opened: {error}. Is it a serial port, and is the robot paired? Try: bns doctor"


def _ports_there_are() -> str:
    found = sorted(p.device for p in comports()) + sorted(str(p) for p in Path("/dev").glob("rfcomm*"))
    return f"Ports there are: {', '.join(found)}." if found else "No serial port was found; is it plugged in or paired?"
