"""How a Wii remote hangs above the floor, found from the triangle of lights on a robot whose pose is known.

Of the two mirror images only one fits a triangle without equal sides, and its turn, size and place are those of the camera.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np

from bns.errors import HardwareError
from bns.hardware.clock import Clock
from bns.hardware.tracking.rigid import placed
from bns.hardware.tracking.wii import HEIGHT_PX, LEDS_M, WIDTH_PX, Overhead, WiiTracker

ON_THE_START = np.array([0.0, 0.0, math.pi / 2])
"""Where the robot stands meanwhile: on the task's origin, its nose to the north."""
_WORST_M, _CLEARLY = 0.004, 3.0
_LOOKS, _BETWEEN_S, _PATIENCE = 50, 0.02, 10
_SETTLED_PX = 3.0


@dataclass(frozen=True)
class Hanging:
    """The camera found, the RMS with which the lights fit, and that of the better fit of the other mirror image, m."""

    camera: Overhead
    rms_m: float
    mirrored_rms_m: float

    def in_words(self) -> str:
        """The lines of a rig's tracker, with their reliability."""
        camera = self.camera
        return (
            f"  view_rad: {camera.view_rad:.3f}\n  up_rad: {camera.up_rad:.3f}\n  mirror: {str(camera.mirror).lower()}\n"
            f"  x_m: {camera.x_m:.3f}\n  y_m: {camera.y_m:.3f}\n"
            f"the lights fit within {1000 * self.rms_m:.1f} mm, mirrored {1000 * self.mirrored_rms_m:.1f} mm; "
            f"at that height the camera sees {WIDTH_PX * camera.m_per_px:.2f} x {HEIGHT_PX * camera.m_per_px:.2f} m"
        )


def hanging(lights_px: np.ndarray, pose: np.ndarray, height_m: float, leds_m: np.ndarray = LEDS_M) -> Hanging:
    """The camera that sees the LEDs of a robot at `pose` (3,) as `lights_px` (3, 2), in any order, as the kernel reports them.

    HardwareError if they fit no such triangle, or both mirror images alike.
    """
    if len(lights_px) != len(leds_m):
        raise HardwareError(f"{len(lights_px)} lights are seen; {len(leds_m)} are needed. Cover reflections.")
    world = placed(leds_m, pose) @ [1.0, 1.0j]
    orders = [list(order) for order in permutations(range(len(world)))]
    fits = {mirror: min((_fit(lights_px[o], world, mirror) for o in orders), key=_rms) for mirror in (False, True)}
    mirror = min(fits, key=lambda m: fits[m][0])
    (rms_m, scale, shift), other_m = fits[mirror], fits[not mirror][0]
    if rms_m > _WORST_M or other_m < _CLEARLY * rms_m:
        raise HardwareError(
            f"the lights do not fit the LEDs clearly: within {1000 * rms_m:.1f} mm, mirrored {1000 * other_m:.1f} mm. Measure "
            "leds_m again (to the right of the axle's middle, ahead of it); the triangle's sides must differ by centimetres."
        )
    view_rad = 2.0 * math.atan(abs(scale) * WIDTH_PX / 2.0 / height_m)
    return Hanging(Overhead(height_m, view_rad, shift.real, shift.imag, float(np.angle(scale)), mirror), rms_m, other_m)


def look_at_lights(tracker: WiiTracker, clock: Clock, count: int = len(LEDS_M)) -> np.ndarray:
    """Mean places (count, 2) of the lights of a robot that stands; HardwareError if so many are not seen, or they move."""
    seen: list[np.ndarray] = []
    for _ in range(_PATIENCE * _LOOKS):
        clock.sleep(_BETWEEN_S)
        lights = tracker.lights_px()
        if len(lights) == count:
            seen.append(lights.astype(np.float64))
        if len(seen) == _LOOKS:
            spread_px = float(np.ptp(np.stack(seen), axis=0).max())
            if spread_px > _SETTLED_PX:
                raise HardwareError(f"the lights move by {spread_px:.0f} pixels; let the robot stand, and cover reflections.")
            return np.asarray(np.mean(seen, axis=0))
    looks = _PATIENCE * _LOOKS
    raise HardwareError(f"{count} lights were seen in {len(seen)} of {looks} looks. Is the robot in view, are its LEDs lit?")


def checked_tracker(settings: Mapping[str, Any]) -> float:
    """The camera's height of a rig whose tracker is a Wii remote; HardwareError of another."""
    if settings.get("kind") != "wii":
        raise HardwareError(f"--wii is for a rig whose tracker is wii; this one's is {settings.get('kind')!r}.")
    return float(settings["height_m"])


def _fit(px: np.ndarray, world: np.ndarray, mirror: bool) -> tuple[float, complex, complex]:
    """RMS, turn and size (metres a pixel, along the picture's y), and the floor point of the picture's middle."""
    across, up = (px - [WIDTH_PX / 2, HEIGHT_PX / 2]).T
    local = up - 1j * (-across if mirror else across)
    spread, target = local - local.mean(), world - world.mean()
    scale = complex(np.vdot(spread, target) / np.vdot(spread, spread).real)
    shift = complex(world.mean() - scale * local.mean())
    return float(np.sqrt(np.mean(np.abs(shift + scale * local - world) ** 2))), scale, shift


def _rms(fit: tuple[float, complex, complex]) -> float:
    return fit[0]
