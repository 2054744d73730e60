"""Two round markers of different colours, yellow and green unless told otherwise: their positions, and a heading between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.clock import Clock
from bns.hardware.tracking.calibration import load_calibration
from bns.hardware.tracking.camera import Frame, FrameTracker, open_camera
from bns.hardware.tracking.kinds import Device, Pose, Settings
from bns.hardware.tracking.lens import Lens
from bns.hardware.tracking.picture import SETTINGS as PICTURE
from bns.hardware.tracking.sight import Sight

if TYPE_CHECKING:
    from bns.hardware.clock import EmulatedClock
    from bns.hardware.emulators.faults import Faults
with extra("robot"):
    import cv2

SETTINGS = Settings(
    ("camera", "calibration", "diameter_m", "height_m"),
    ("distance_m", "yellow", "green", *PICTURE),
    ("diameter_m", "height_m", "distance_m"),
)
YELLOW, GREEN = (20, 38), (50, 85)
"""Hues as OpenCV counts them, 0 to 179."""
HUE_GAP = 5
SATURATION, VALUE = 110, 60
_ROUND = 0.75
_AREA_SHARE = (0.4, 2.0)
_DISTANCE_SHARE = 0.2


@dataclass(frozen=True)
class Markers:
    """Two markers: hues (low, high) of each, diameter, height above the floor and, if fixed (0: not), their distance, m."""

    diameter_m: float
    height_m: float
    distance_m: float = 0.0
    yellow: tuple[int, int] = YELLOW
    green: tuple[int, int] = GREEN

    def __post_init__(self) -> None:
        low, high = sorted([self.yellow, self.green])
        if high[0] - low[1] < HUE_GAP:
            raise HardwareError(
                f"the marker colours are too close: hues {low} and {high} leave {high[0] - low[1]} between them; at least "
                f"{HUE_GAP} of 180 are needed. Take markers of other colours, or narrow the ranges in the rig."
            )


class Shape(NamedTuple):
    """A blob's area as a share of a marker's, its roundness (1: a circle), and whether it can be a marker."""

    area_share: float
    roundness: float
    good: bool


def in_hsv(picture: np.ndarray) -> np.ndarray:
    """Hue (0 to 179), saturation and value of a BGR picture, a little smoothed."""
    found: np.ndarray = cv2.cvtColor(cv2.GaussianBlur(picture, (0, 0), 1.0), cv2.COLOR_BGR2HSV)
    return found


class ColourDetector:
    """Finds both markers in a frame. Gates on area, roundness and distance: what fails is not seen."""

    def __init__(self, lens: Lens, markers: Markers) -> None:
        self._lens, self._markers = lens, markers

    @property
    def hues(self) -> dict[str, tuple[int, int]]:
        """Name of a marker -> its range of hues."""
        return {"yellow": self._markers.yellow, "green": self._markers.green}

    def find(self, frame: Frame) -> Sight | None:
        """Pose: the middle between the markers, heading from yellow to green; `points` has both. None if one is not seen."""
        hsv = in_hsv(frame.picture)
        yellow, green = (self._marker(frame.picture, hsv, hue) for hue in (self._markers.yellow, self._markers.green))
        if yellow is None or green is None:
            return None
        between = green - yellow
        distance_m, wanted_m = float(np.hypot(*between)), self._markers.distance_m
        if wanted_m and abs(distance_m - wanted_m) > _DISTANCE_SHARE * wanted_m:
            return None
        pose = np.array([*(yellow + green) / 2, np.arctan2(between[1], between[0])])
        residual_m = abs(distance_m - wanted_m) if wanted_m else 0.0
        return Sight(frame.t_s, pose, residual_m, {"yellow": yellow, "green": green})

    def _marker(self, picture: np.ndarray, hsv: np.ndarray, hue: tuple[int, int]) -> np.ndarray | None:
        """Where the one marker of this colour is (2,), m; None if there is none, or more than one."""
        good = [outline for outline in self.outlines(hsv, hue) if self.shape(outline).good]
        if len(good) != 1:
            return None
        middle = _centroid(good[0], picture, hsv)
        found: np.ndarray = self._lens.on_plane(middle[None], self._markers.height_m)[0]
        return found if np.isfinite(found).all() else None

    def mask(self, hsv: np.ndarray, hue: tuple[int, int]) -> np.ndarray:
        """Where a picture is of these hues, and coloured enough (255; else 0)."""
        found: np.ndarray = cv2.inRange(hsv, np.array([hue[0], SATURATION, VALUE]), np.array([hue[1], 255, 255]))
        return found

    def outlines(self, hsv: np.ndarray, hue: tuple[int, int]) -> Sequence[np.ndarray]:
        """Of all blobs there."""
        found: Sequence[np.ndarray] = cv2.findContours(self.mask(hsv, hue), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
        return found

    def shape(self, outline: np.ndarray) -> Shape:
        """What a blob looks like on the plane of the markers."""
        area, around = cv2.contourArea(outline), cv2.arcLength(outline, True)
        if area < 12 or len(outline) < 5:
            return Shape(0.0, 0.0, False)
        edge_m = self._lens.on_plane(outline.reshape(-1, 2).astype(np.float64), self._markers.height_m)
        area_m2 = float(cv2.contourArea(edge_m.astype(np.float32)))
        wanted_m2 = np.pi / 4 * self._markers.diameter_m**2
        share, roundness = float(area_m2 / wanted_m2), float(4 * np.pi * area / around**2)
        return Shape(share, roundness, _AREA_SHARE[0] <= share <= _AREA_SHARE[1] and roundness >= _ROUND)


def _centroid(outline: np.ndarray, picture: np.ndarray, hsv: np.ndarray) -> np.ndarray:
    """Middle of a blob, weighted by saturation: edge pixels count by how much of the marker they hold."""
    x, y, width, height = cv2.boundingRect(outline)
    rows = slice(max(y - 2, 0), min(y + height + 2, picture.shape[0]))
    columns = slice(max(x - 2, 0), min(x + width + 2, picture.shape[1]))
    weight = np.clip(hsv[rows, columns, 1].astype(np.float64) - 60.0, 0.0, None)
    down, across = np.mgrid[rows, columns]
    return np.array([(across * weight).sum(), (down * weight).sum()]) / weight.sum()


def _hues(name: str, given: Any) -> tuple[int, ...]:
    good = isinstance(given, list) and len(given) == 2 and all(type(h) is int and 0 <= h <= 179 for h in given)
    if not good or given[0] >= given[1]:
        raise HardwareError(f"the colour tracker: {name} is {given!r}; write two hues, 0 to 179, the lower one first.")
    return tuple(given)


def detector(settings: Mapping[str, Any]) -> ColourDetector:
    """The detector that a rig describes."""
    return ColourDetector(load_calibration(Path(str(settings["calibration"]))).lens, markers_of(settings))


def markers_of(settings: Mapping[str, Any]) -> Markers:
    """The markers that a rig describes."""
    hues = {name: _hues(name, settings[name]) for name in ("yellow", "green") if name in settings}
    sizes = {name: float(settings[name]) for name in SETTINGS.sizes if name in settings}
    return Markers(**sizes, **hues)  # type: ignore[arg-type]  # two hues each


def open_tracker(settings: Mapping[str, Any], clock: Clock) -> FrameTracker:
    """The tracker of a rig."""
    find = detector(settings)
    return FrameTracker(open_camera(settings, clock), find.find)


def emulate(
    settings: Mapping[str, Any], folder: Path, pose: Pose, clock: EmulatedClock, faults: Faults, seed: int
) -> tuple[dict[str, Any], Device]:
    """An emulated camera above a robot that wears the two discs, yellow behind."""
    from bns.hardware.emulators.watchers import emulated_camera, worn_discs  # noqa: PLC0415  # a real robot needs no emulators

    return emulated_camera(settings, folder, lambda t_s: worn_discs(settings, pose(t_s)), clock, faults, seed)
