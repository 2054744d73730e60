"""ArUco markers: one printed square on the robot tells its pose by itself, whatever the light's colour."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.clock import Clock
from bns.hardware.tracking.calibration import load_calibration
from bns.hardware.tracking.camera import Camera, Frame, FrameTracker, open_camera
from bns.hardware.tracking.kinds import Device, Pose, Settings
from bns.hardware.tracking.lens import Lens
from bns.hardware.tracking.picture import SETTINGS as PICTURE
from bns.hardware.tracking.rigid import fit
from bns.hardware.tracking.sight import Sight

if TYPE_CHECKING:
    from bns.hardware.clock import EmulatedClock
    from bns.hardware.emulators.faults import Faults
with extra("robot"):
    import cv2

SETTINGS = Settings(("camera", "calibration", "side_m", "height_m"), ("number", *PICTURE), ("side_m", "height_m"))
_WORST_SHARE = 0.1
"""A marker whose corners do not form a square of its size, to this share of its side, is none."""


class ArucoDetector:
    """Finds marker `number` of side `side_m` at `height_m` above the floor; its top edge is ahead."""

    def __init__(self, lens: Lens, number: int, side_m: float, height_m: float) -> None:
        self._lens, self._number, self._side_m, self._height_m = lens, number, side_m, height_m
        words = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        settings = cv2.aruco.DetectorParameters()
        settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._detector = cv2.aruco.ArucoDetector(words, settings)
        half = side_m / 2
        self._corners_m = np.array([[-half, half], [half, half], [half, -half], [-half, -half]])

    def find(self, frame: Frame) -> Sight | None:
        """The pose, or None: the marker is not there, is there twice, or is not of its size."""
        found, numbers, _ = self._detector.detectMarkers(frame.picture)
        own = [] if numbers is None else [c for c, n in zip(found, numbers.ravel(), strict=True) if n == self._number]
        if len(own) != 1:
            return None
        seen = self._lens.on_plane(own[0].reshape(4, 2), self._height_m)
        pose, rms = fit(self._corners_m, seen)
        if not rms <= _WORST_SHARE * self._side_m:
            return None
        return Sight(frame.t_s, pose, rms, {f"corner{i}": corner for i, corner in enumerate(seen)})


def detector(settings: Mapping[str, Any]) -> ArucoDetector:
    """The detector that a rig describes."""
    lens, number = load_calibration(Path(str(settings["calibration"]))).lens, settings.get("number", 0)
    if type(number) is not int or not 0 <= number < 50:
        raise HardwareError(f"the aruco tracker: number is {number!r}; markers of this kind (4x4) have the numbers 0 to 49.")
    return ArucoDetector(lens, number, float(settings["side_m"]), float(settings["height_m"]))


def open_tracker(settings: Mapping[str, Any], clock: Clock) -> FrameTracker:
    """The tracker of a rig."""
    find = detector(settings)
    camera: Camera = open_camera(settings, clock)
    return FrameTracker(camera, find.find)


def emulate(
    settings: Mapping[str, Any], folder: Path, pose: Pose, clock: EmulatedClock, faults: Faults, seed: int
) -> tuple[dict[str, Any], Device]:
    """An emulated camera above a robot that wears the marker."""
    from bns.hardware.emulators.watchers import emulated_camera, worn_tag  # noqa: PLC0415  # a real robot needs no emulators

    return emulated_camera(settings, folder, lambda t_s: worn_tag(settings, pose(t_s)), clock, faults, seed)
