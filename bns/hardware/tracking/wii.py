"""The infra-red camera of a Wii remote above the floor, as Linux reports it: input events of a device file.

The remote reports up to four lights; which is which it does not say. Three LEDs in a triangle without two equal sides
tell the pose. What the kernel hands on (drivers/hid/hid-wiimote-modules.c, `wiimod_ir_in_ir`): the camera's own ten bits, x in
ABS_HAT0X .. ABS_HAT3X to the right (0..1023), y in ABS_HAT0Y .. ABS_HAT3Y **upwards** (0..767), both 1023 where no light is.
Pointer programs use them so: they turn x round and take y as it is; what a remote sees moves against what it points at.
Changes alone are events: a robot that stands gives none if nothing jitters, so what was reported holds while `Pulse` is felt.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bns.errors import HardwareError
from bns.hardware.clock import Clock
from bns.hardware.tracking.infrared.evdev import (
    ABS_HAT0X,
    EV_ABS,
    EV_SYN,
    EVENT,
    SYN_DROPPED,
    SYN_REPORT,
    absolute,
    device_file,
    stamp_by_steady_clock,
)
from bns.hardware.tracking.infrared.wii_pulse import Pulse, battery_of
from bns.hardware.tracking.kinds import Device, Pose, Settings
from bns.hardware.tracking.rigid import best_fit
from bns.hardware.tracking.sight import Sight

if TYPE_CHECKING:
    from bns.hardware.clock import EmulatedClock
    from bns.hardware.emulators.faults import Faults

KERNEL_NAME = "Nintendo Wii Remote IR"
SETTINGS = Settings(
    ("height_m", "view_rad"),
    ("device", "battery", "x_m", "y_m", "up_rad", "mirror", "leds_m"),
    ("height_m", "view_rad"),
)
LIGHTS, WIDTH_PX, HEIGHT_PX = 4, 1024, 768
NOTHING_PX = 1023
"""What the driver reports in both coordinates of a light that is not there."""
LEDS_M = np.array([[0.0, 0.060], [-0.045, -0.020], [0.020, -0.050]])
"""Where the LEDs sit on the robot: to the right of the axle's middle, ahead of it. The sides differ by
2 cm, so that its mirror image fits nowhere."""
_WORST_M = 0.006
_OLDEST_S = 1.0
"""A stamp that says more is by another clock."""


@dataclass(frozen=True)
class Overhead:
    """A camera that looks straight down: height above the lights, horizontal field of view, the floor point it looks at.

    `up_rad`: direction in which y grows, in the world frame, counter-clockwise from x. `mirror`: x grows to the left of that.
    """

    height_m: float
    view_rad: float
    x_m: float = 0.0
    y_m: float = 0.0
    up_rad: float = float(np.pi / 2)
    mirror: bool = False

    @property
    def m_per_px(self) -> float:
        """Size of a pixel on the plane of the lights."""
        return 2.0 * self.height_m * float(np.tan(self.view_rad / 2.0)) / WIDTH_PX

    def floor_m(self, px: np.ndarray) -> np.ndarray:
        """What the kernel reports (n, 2), x to the right and y up -> (n, 2) on the plane of the lights."""
        right, up = ((px - [WIDTH_PX / 2, HEIGHT_PX / 2]) * self.m_per_px).T
        world = (self.x_m + 1j * self.y_m) + (up - 1j * self._hand * right) * np.exp(1j * self.up_rad)
        return np.column_stack([world.real, world.imag])

    def px(self, floor_m: np.ndarray) -> np.ndarray:
        """The inverse of `floor_m`."""
        local = (floor_m[:, 0] - self.x_m + 1j * (floor_m[:, 1] - self.y_m)) * np.exp(-1j * self.up_rad)
        right, up = -self._hand * local.imag / self.m_per_px, local.real / self.m_per_px
        return np.column_stack([WIDTH_PX / 2 + right, HEIGHT_PX / 2 + up])

    @property
    def _hand(self) -> float:
        return -1.0 if self.mirror else 1.0


class WiiTracker:
    """Keeps what was reported last, fits the LEDs. `leds_m` (3, 2) as in `LEDS_M`; `pulse` tells whether the remote lives."""

    def __init__(
        self, device: str, camera: Overhead, clock: Clock, leds_m: np.ndarray = LEDS_M, pulse: Pulse | None = None
    ) -> None:
        self._camera, self._clock, self._leds_m, self._pulse = camera, clock, leds_m, pulse
        self._rest, self._reported_s, self._dropped = b"", -1.0, False
        try:
            self._file = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise HardwareError(
                f"cannot open the Wii remote at {device}: {error.strerror}. Press 1+2 on the remote to pair it, and make "
                "sure that you are in the group input. Try: bns doctor"
            ) from error
        stamp_by_steady_clock(self._file)
        self._px = self._asked()

    def lights_px(self) -> np.ndarray:
        """The lights reported last (n, 2), as the kernel reports them."""
        self._drain()
        lit: np.ndarray = self._px[(self._px != NOTHING_PX).any(axis=1)]
        return lit

    def look(self) -> Sight | None:
        """The newest sight. Its time is that of the newest report, or of the newest sign of life after it: then nothing moved."""
        lit = self.lights_px()
        seen_s = self._reported_s if self._pulse is None else self._pulse.last_s(self._reported_s)
        if seen_s < 0 or len(lit) < len(self._leds_m):
            return None
        found = best_fit(self._leds_m, self._camera.floor_m(lit.astype(np.float64)), _WORST_M)
        return None if found is None else Sight(seen_s, found[0], found[1])

    def close(self) -> None:
        """Close the device file."""
        if self._pulse is not None:
            self._pulse.close()
        os.close(self._file)

    def _drain(self) -> None:
        while True:
            try:
                data = os.read(self._file, 64 * EVENT.size)
            except BlockingIOError:
                return
            except OSError as error:
                raise HardwareError(f"the Wii remote is disconnected: {error.strerror}. Check its batteries.") from error
            if not data:
                return
            self._take(self._rest + data)

    def _take(self, data: bytes) -> None:
        whole = len(data) - len(data) % EVENT.size
        self._rest = data[whole:]
        for seconds, micros, kind, code, value in EVENT.iter_unpack(data[:whole]):
            if kind == EV_SYN and code == SYN_DROPPED:
                self._dropped = True  # the kernel lost events: what comes up to the next report is a part of one
            elif kind == EV_SYN and code == SYN_REPORT:
                self._px = self._asked() if self._dropped else self._px
                self._dropped, self._reported_s = False, self._stamped_s(seconds + 1e-6 * micros)
            elif kind == EV_ABS and ABS_HAT0X <= code < ABS_HAT0X + 2 * LIGHTS and not self._dropped:
                self._px[divmod(code - ABS_HAT0X, 2)] = value

    def _stamped_s(self, stamp_s: float) -> float:
        """When the kernel got a report, by the trial's clock; where it counts by another one, when it was read."""
        now_s = self._clock.now_s()
        return stamp_s if 0.0 <= now_s - stamp_s < _OLDEST_S else now_s

    def _asked(self) -> np.ndarray:
        """What the kernel remembers of all lights (4, 2); nothing where it cannot be asked, until it has been reported again."""
        values = [absolute(self._file, ABS_HAT0X + i) for i in range(2 * LIGHTS)]
        known = [NOTHING_PX if value is None else value for value in values]
        return np.array(known, np.int64).reshape(LIGHTS, 2)


def overhead(settings: Mapping[str, Any]) -> Overhead:
    """The camera that a rig describes."""
    mirror = settings.get("mirror", False)
    if not isinstance(mirror, bool):
        raise HardwareError(f"the wii tracker: mirror is {mirror!r}; it is true or false. bns calibrate --wii finds it.")
    numbers = {n: v for n, v in settings.items() if n not in {"kind", "device", "battery", "leds_m", "mirror"}}
    try:
        return Overhead(**{name: float(value) for name, value in numbers.items()}, mirror=mirror)
    except (TypeError, ValueError) as error:
        raise HardwareError(f"the wii tracker has a setting that is no number: {dict(settings)!r}") from error


def open_tracker(settings: Mapping[str, Any], clock: Clock) -> WiiTracker:
    """The tracker of a rig. Its `device` is a device file, or the name that the kernel gives it."""
    camera = overhead(settings)
    device = device_file(str(settings.get("device", KERNEL_NAME)))
    battery = settings.get("battery") or battery_of(device)
    pulse = None if battery is None else Pulse(battery, clock)
    return WiiTracker(device, camera, clock, np.asarray(settings.get("leds_m", LEDS_M), np.float64), pulse)


def emulate(
    settings: Mapping[str, Any], folder: Path, pose: Pose, clock: EmulatedClock, faults: Faults, seed: int
) -> tuple[dict[str, Any], Device]:
    """A pipe into which an emulated remote writes what it sees."""
    from bns.hardware.emulators.devices.wii import WiiEmulator  # noqa: PLC0415  # a real robot needs no emulators

    path = folder / "wiimote"
    remote = WiiEmulator(path, pose, overhead(settings), clock, faults, seed)
    return {**settings, "device": str(path), "battery": str(remote.battery)}, remote
