"""Linux input devices: their events as bytes, what the kernel remembers of them, and how they are found by name.

Formats: include/uapi/linux/input.h and input-event-codes.h; Documentation/input/event-codes.rst on SYN_DROPPED.
"""

from __future__ import annotations

import contextlib
import struct
import time
from pathlib import Path
from typing import NamedTuple

from bns.errors import HardwareError

EVENT = struct.Struct("llHHi")
"""struct input_event: seconds, microseconds, type, code, value."""
EV_SYN, EV_ABS, SYN_REPORT, SYN_DROPPED, ABS_HAT0X = 0, 3, 0, 3, 0x10
CLASS = Path("/sys/class/input")
_ABSINFO = struct.Struct("6i")
"""struct input_absinfo: value, minimum, maximum, fuzz, flat, resolution."""
_CLOCK = struct.Struct("i")
_SET_CLOCK = 1 << 30 | _CLOCK.size << 16 | ord("E") << 8 | 0xA0
_READ = 2 << 30 | _ABSINFO.size << 16 | ord("E") << 8


class InputDevice(NamedTuple):
    """An event device: its file and the name that its driver gives it."""

    file: Path
    name: str


def input_devices(root: Path = CLASS) -> list[InputDevice]:
    """All event devices of this computer, by number."""
    found = []
    for entry in sorted(root.glob("event*"), key=lambda path: int(path.name.removeprefix("event"))):
        try:
            found.append(InputDevice(Path("/dev/input") / entry.name, (entry / "device" / "name").read_text().strip()))
        except OSError:  # it was unplugged meanwhile
            continue
    return found


def device_file(name: str, root: Path = CLASS) -> str:
    """The file of the device with that name; a path is taken as it is. HardwareError if there is none, or more than one."""
    if "/" in name:
        return name
    devices = input_devices(root)
    found = [str(device.file) for device in devices if device.name == name]
    if len(found) == 1:
        return found[0]
    if found:
        raise HardwareError(f"{len(found)} input devices are called {name!r}: {', '.join(found)}. Name one as device.")
    others = ", ".join(sorted({device.name for device in devices})) or "none at all"
    raise HardwareError(f"no input device is called {name!r}; there are: {others}. Press 1+2 on the remote to pair it.")


def absolute(file: int, axis: int) -> int | None:
    """What the kernel remembers as the value of an axis (EVIOCGABS); None of a file that is no input device."""
    import fcntl  # noqa: PLC0415  # Windows has none

    try:
        return int(_ABSINFO.unpack(fcntl.ioctl(file, _READ | 0x40 + axis, bytes(_ABSINFO.size)))[0])
    except OSError:
        return None


def stamp_by_steady_clock(file: int) -> None:
    """Have the kernel stamp events by CLOCK_MONOTONIC (EVIOCSCLOCKID); a file that is no input device stays as it is."""
    import fcntl  # noqa: PLC0415  # Windows has none

    with contextlib.suppress(OSError):
        fcntl.ioctl(file, _SET_CLOCK, _CLOCK.pack(time.CLOCK_MONOTONIC))
