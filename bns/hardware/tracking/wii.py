"""The infra-red camera of a Wii remote above the floor, as Linux reports it: input events of a device file.

The remote reports up to four lights; which is which it does not say. Three LEDs in a triangle without two equal sides
tell the pose.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bns.errors import HardwareError
from bns.hardware.clock import Clock
from bns.hardware.tracking.kinds import Device, Pose, Settings
from bns.hardware.tracking.rigid import best_fit
from bns.hardware.tracking.sight import Sight

if TYPE_CHECKING:
    from bns.hardware.clock import EmulatedClock
    from bns.hardware.emulators.faults import Faults

SETTINGS = Settings(
    ("device", "height_m", "view_rad"), ("x_m", "y_m", "up_rad", "leds_m"), ("height_m", "view_rad")
)
EVENT = struct.Struct("llHHi")
"""struct input_event of the kernel: seconds, microseconds, type, code, value."""
EV_SYN, EV_ABS, SYN_REPORT, SYN_DROPPED, ABS_HAT0X = 0, 3, 0, 3, 0x10
LIGHTS, WIDTH_PX, HEIGHT_PX = 4, 1024, 768
NOTHING_PX = 1023
"""What the driver reports in both coordinates of a light that is not there."""
LEDS_M = np.array([[0.0, 0.060], [-0.045, -0.020], [0.020, -0.050]])
"""Where the LEDs sit on the robot: to the right of the axle's middle, ahead of it. The sides differ by
2 cm, so that its mirror image fits nowhere."""
_WORST_M = 0.006


@dataclass(frozen=True)
class Overhead:
    """A camera that looks straight down: height above the lights, horizontal field of view, the floor point it looks at.

    `up_rad`: direction of the picture's top in the world frame, counter-clockwise from x.
    """

    height_m: float
    view_rad: float
    x_m: float = 0.0
    y_m: float = 0.0
    up_rad: float = float(np.pi / 2)

    @property
    def m_per_px(self) -> float:
        """Size of a pixel on the plane of the lights."""
        return 2.0 * self.height_m * float(np.tan(self.view_rad / 2.0)) / WIDTH_PX

    def floor_m(self, px: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) from the upper left corner -> (n, 2) on the plane of the lights."""
        right, up = (px[:, 0] - WIDTH_PX / 2) * self.m_per_px, (HEIGHT_PX / 2 - px[:, 1]) * self.m_per_px
        world = (self.x_m + 1j * self.y_m) + (up - 1j * right) * np.exp(1j * self.up_rad)
        return np.column_stack([world.real, world.imag])

    def px(self, floor_m: np.ndarray) -> np.ndarray:
        """The inverse of `floor_m`."""
        local = (floor_m[:, 0] - self.x_m + 1j * (floor_m[:, 1] - self.y_m)) * np.exp(-1j * self.up_rad)
        return np.column_stack([WIDTH_PX / 2 - local.imag / self.m_per_px, HEIGHT_PX / 2 - local.real / self.m_per_px])


class WiiTracker:
    """Reads events, keeps the newest report, fits the LEDs. `leds_m` (3, 2) as in `LEDS_M`."""

    def __init__(self, device: str, camera: Overhead, clock: Clock, leds_m: np.ndarray = LEDS_M) -> None:
        self._camera, self._clock, self._leds_m = camera, clock, leds_m
        self._px = np.full((LIGHTS, 2), NOTHING_PX, np.int64)
        self._rest, self._reported_s = b"", -1.0
        try:
            self._file = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise HardwareError(
                f"cannot open the Wii remote at {device}: {error.strerror}. Press 1+2 on the remote to pair it, and make "
                "sure that you are in the group input. Try: bns doctor"
            ) from error

    def look(self) -> Sight | None:
        """The newest sight; its time is that of the newest report, which may be older than now."""
        self._drain()
        lit = self._px[(self._px != NOTHING_PX).any(axis=1)]
        if self._reported_s < 0 or len(lit) < len(self._leds_m):
            return None
        found = best_fit(self._leds_m, self._camera.floor_m(lit.astype(np.float64)), _WORST_M)
        return None if found is None else Sight(self._reported_s, found[0], found[1])

    def close(self) -> None:
        """Close the device file."""
        os.close(self._file)

    def _drain(self) -> None:
        while True:
            try:
                data = os.read(self._file, 64 * EVENT.size)
            except BlockingIOError:
                return
            except OSError as error:
                raise HardwareError(f"the Wii remote is gone: {error.strerror}. Change its batteries, pair it again.") from error
            if not data:
                return
            self._take(self._rest + data)

    def _take(self, data: bytes) -> None:
        whole = len(data) - len(data) % EVENT.size
        self._rest = data[whole:]
        for _seconds, _micros, kind, code, value in EVENT.iter_unpack(data[:whole]):
            if kind == EV_ABS and ABS_HAT0X <= code < ABS_HAT0X + 2 * LIGHTS:
                self._px[divmod(code - ABS_HAT0X, 2)] = value
            elif kind == EV_SYN and code == SYN_DROPPED:
                # The kernel lost events: what is remembered may be wrong until every light has been reported again.
                self._px[:] = NOTHING_PX
            elif kind == EV_SYN and code == SYN_REPORT:
                self._reported_s = self._clock.now_s()


def overhead(settings: Mapping[str, Any]) -> Overhead:
    """The camera that a rig describes."""
    try:
        return Overhead(**{name: float(value) for name, value in settings.items() if name not in {"kind", "device", "leds_m"}})
    except (TypeError, ValueError) as error:
        raise HardwareError(f"the wii tracker has a setting that is no number: {dict(settings)!r}") from error


def open_tracker(settings: Mapping[str, Any], clock: Clock) -> WiiTracker:
    """The tracker of a rig."""
    camera = overhead(settings)
    return WiiTracker(str(settings["device"]), camera, clock, np.asarray(settings.get("leds_m", LEDS_M), np.float64))


def emulate(
    settings: Mapping[str, Any], folder: Path, pose: Pose, clock: EmulatedClock, faults: Faults, seed: int
) -> tuple[dict[str, Any], Device]:
    """A pipe into which an emulated remote writes what it sees."""
    from bns.hardware.emulators.wii import WiiEmulator  # noqa: PLC0415  # a real robot needs no emulators

    path = folder / "wiimote"
    return {**settings, "device": str(path)}, WiiEmulator(path, pose, overhead(settings), clock, faults, seed)
