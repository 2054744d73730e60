"""The port that a guard owns, and the pseudo-terminal that it gives to the robot's driver instead. Standard library alone."""

from __future__ import annotations

import contextlib
import os
import select
import time
from collections.abc import Sequence
from pathlib import Path

with contextlib.suppress(ImportError):  # not on Windows, where a robot's port has no guard
    import fcntl
    import termios
    import tty

_WRITE_S = 0.2


class OtherDeviceError(OSError):
    """A device that is not the robot's has taken the port's name."""


def identity(port: str, sysfs: str) -> str | None:
    """What tells the device at a port from others that may get its name: a USB adapter's makers and serial number (without one,
    the socket that it is plugged into), a Bluetooth robot's address. None where the system does not say.
    """
    device = Path(sysfs) / "class" / "tty" / Path(os.path.realpath(port)).name
    if address := _text(device / "address"):  # rfcomm
        return f"bluetooth {address} {_text(device / 'channel')}"
    place = Path(os.path.realpath(device / "device"))
    for folder in (place, *place.parents):
        if vendor := _text(folder / "idVendor"):
            return f"usb {vendor}:{_text(folder / 'idProduct')} {_text(folder / 'serial') or folder.name}"
    return None


def ports_of(wanted: str, sysfs: str) -> list[str]:
    """The names of the ports at which there is such a device: cheap adapters may all have the same serial number."""
    try:
        names = sorted(entry.name for entry in (Path(sysfs) / "class" / "tty").iterdir())
    except OSError:
        return []
    return [name for name in names if identity(name, sysfs) == wanted]


def twins_of(port: str, sysfs: str) -> list[str]:
    """The names of other ports whose devices cannot be told from the one at this port."""
    own = identity(port, sysfs)
    return [] if own is None else [name for name in ports_of(own, sysfs) if name != Path(os.path.realpath(port)).name]


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""


def opened(port: str, baud: int) -> int:
    """The port, locked and raw; OSError."""
    line = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        fcntl.flock(line, fcntl.LOCK_EX | fcntl.LOCK_NB)
        tty.setraw(line)
        speed = getattr(termios, f"B{baud}")
        flags = termios.tcgetattr(line)
        flags[2] = termios.CS8 | termios.CREAD | termios.CLOCAL
        flags[4] = flags[5] = speed
        termios.tcsetattr(line, termios.TCSANOW, flags)
        termios.tcflush(line, termios.TCIFLUSH)
    except (OSError, termios.error) as error:
        os.close(line)
        raise OSError(*error.args[:2]) from error
    return line


class Line:
    """`port` is the robot's, `near` our end of the driver's, -1 while they are closed; `link` points to the driver's end."""

    def __init__(
        self, port: str, baud: int, link: str, poll: select.poll, sysfs: str = "/sys", twins: Sequence[str] = ()
    ) -> None:
        self._name, self._baud, self._link, self._poll, self._sysfs = port, baud, Path(link), poll, sysfs
        self._folder, self._twins = Path(os.path.realpath(port)).parent, twins
        self.port = self.near = self._far = -1
        self.at = port
        """The name under which the device was found last."""
        self.identity: str | None = None
        """Of the device at the port; another one is not opened."""

    def open(self) -> None:
        """Take the port, and make the line that the driver opens instead of it; OSError.

        Only the device of the first time is opened: opening another one could start it. It may have come back under another
        name, but not under that of a device like it which was there before.
        """
        name, found = self._name, identity(self._name, self._sysfs)
        if self.identity not in {None, found}:
            moved = next((name for name in ports_of(str(self.identity), self._sysfs) if name not in self._twins), None)
            if moved is None and Path(self._name).exists():
                raise OtherDeviceError(f"at {self._name} is {found or 'a device without a name'}, not {self.identity}")
            name, found = (self._name, found) if moved is None else (str(self._folder / moved), self.identity)
        self.port, self.at = opened(name, self._baud), name
        self.identity = found
        self.near, self._far = os.openpty()
        tty.setraw(self._far)
        os.set_blocking(self.near, False)
        for line in (self.port, self.near):
            self._poll.register(line, select.POLLIN)
        with contextlib.suppress(OSError):
            self._link.parent.mkdir(mode=0o700, exist_ok=True)
            new = self._link.with_suffix(".new")
            new.unlink(missing_ok=True)
            new.symlink_to(os.ttyname(self._far))
            new.replace(self._link)

    def close(self) -> None:
        """Give both ends free."""
        with contextlib.suppress(OSError):
            self._link.unlink(missing_ok=True)
        for line in (self.port, self.near):
            if line >= 0:
                self._poll.unregister(line)
        for line in (self.port, self.near, self._far):
            if line >= 0:
                os.close(line)
        self.port = self.near = self._far = -1

    def to_robot(self, data: bytes) -> bool:
        """Whether the port is still there after it was written to."""
        return self.port < 0 or _written(self.port, data)

    def to_driver(self, data: bytes) -> None:
        """A driver that does not read loses what it was sent."""
        if self.near >= 0:
            _written(self.near, data)


def _written(line: int, data: bytes) -> bool:
    """Write all, but what a line that takes nothing for a while would hold up; whether the line is there."""
    end_s = time.monotonic() + _WRITE_S
    while data:
        try:
            data = data[os.write(line, data) :]
        except BlockingIOError:
            if time.monotonic() > end_s:
                return True
            time.sleep(0.002)
        except OSError:
            return False
    return True
