"""Emulated cameras above a robot, with their calibration, and the markers that the robot wears."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.camera import CameraEmulator
from bns.hardware.emulators.faults import Faults
from bns.hardware.emulators.scene import Patch, Scene, disc, tag
from bns.hardware.tracking.calibration import Calibration
from bns.hardware.tracking.lens import Lens, looking_down

Wears = Callable[[float], list[Patch]]
"""Time -> the markers on a robot as they lie then."""
YELLOW_BGR, GREEN_BGR = (30, 210, 240), (60, 180, 40)


def emulated_lens(scale: float = 1.0, height_m: float = 2.0, tilt_rad: float = 0.05) -> Lens:
    """A wide camera above the floor, a little tilted, with the distortion of its price; 1280 by 720 pixels times `scale`."""
    matrix = np.array([[700.0 * scale, 0.0, 640.0 * scale], [0.0, 700.0 * scale, 360.0 * scale], [0.0, 0.0, 1.0]])
    size = (round(1280 * scale), round(720 * scale))
    return looking_down(matrix, np.array([-0.25, 0.08, 0.001, -0.0005, 0.0]), size, height_m, tilt_rad)


def emulated_camera(
    settings: Mapping[str, Any],
    folder: Path,
    wears: Wears,
    clock: EmulatedClock,
    faults: Faults,
    seed: int,
    lens: Lens | None = None,
    rate_hz: float = 15.0,
) -> tuple[dict[str, Any], CameraEmulator]:
    """A calibrated camera that films the markers a robot wears; the tracker's settings with its address, and the camera."""
    lens, place = lens or emulated_lens(), folder / "camera.json"
    Calibration(lens, 0.0, 0, "the emulated camera").save(place)
    camera = CameraEmulator(_film(lens, wears, clock, faults, seed), clock, rate_hz)
    return {**settings, "camera": camera.address, "calibration": str(place)}, camera


def _film(lens: Lens, wears: Wears, clock: EmulatedClock, faults: Faults, seed: int) -> Callable[[], np.ndarray | None]:
    scene, draw = Scene(lens, seed=seed), np.random.default_rng([seed, 11])
    last: list[np.ndarray] = []

    def render() -> np.ndarray | None:
        now_s = clock.now_s()
        if faults.strikes("stuck-marker", now_s):
            return last[0].copy() if last else None
        if last and faults.strikes("frozen-picture", now_s):
            ticked = last[0].copy()
            ticked[:8, :8] += 40
            last[:] = [ticked]
            return ticked
        patches = [] if faults.strikes("lost-marker", now_s) else wears(now_s)
        if faults.strikes("reflection", now_s):
            patches.append(disc(YELLOW_BGR, 0.04, draw.uniform(-0.5, 0.5), draw.uniform(-0.5, 0.5), 0.0))
        last[:] = [scene.frame(patches)]
        return last[0]

    return render


def worn_tag(settings: Mapping[str, Any], pose: np.ndarray) -> list[Patch]:
    """The printed marker that a robot at `pose` (3,) wears for an aruco tracker."""
    x_m, y_m, heading_rad = (float(v) for v in pose)
    number, height_m = int(settings.get("number", 0)), float(settings["height_m"])
    return [tag(number, float(settings["side_m"]), x_m, y_m, heading_rad, height_m)]


def worn_discs(settings: Mapping[str, Any], pose: np.ndarray) -> list[Patch]:
    """The two discs that a robot at `pose` (3,) wears for a colour tracker."""
    x_m, y_m, heading_rad = (float(v) for v in pose)
    height_m, diameter_m = float(settings["height_m"]), float(settings["diameter_m"])
    half = float(settings.get("distance_m", 0.1)) / 2 * np.array([np.cos(heading_rad), np.sin(heading_rad)])
    ends = ((YELLOW_BGR, -half), (GREEN_BGR, half))
    return [disc(colour, diameter_m, x_m + dx, y_m + dy, height_m) for colour, (dx, dy) in ends]
