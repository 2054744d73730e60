"""Camera calibration with a ChArUco board, and the file it is kept in."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.tracking.floor_pose import Corners, floor_pose
from bns.hardware.tracking.lens import Lens

with extra("robot"):
    import cv2

FEWEST_VIEWS, FEWEST_CORNERS = 8, 8
WORST_RMS_PX = 1.0
LEAST_TILT = np.radians(15.0)
"""Views that differ in tilt by less fit many lenses equally well: rendered ones without tilt, one of a third of the length."""
_WORST_FLOOR_M = 0.01
_FINE_PX = (1280, 720)
_WRONG_SCALE = 0.005


@dataclass(frozen=True)
class Board:
    """A printed ChArUco board: squares across and down, side of a square, side of a marker in it, m. It fills a sheet of A3."""

    across: int = 6
    down: int = 4
    square_m: float = 0.068
    marker_m: float = 0.051

    @property
    def made(self) -> Any:
        """OpenCV's board."""
        words = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
        return cv2.aruco.CharucoBoard((self.across, self.down), self.square_m, self.marker_m, words)

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height."""
        return self.across * self.square_m, self.down * self.square_m

    def picture(self, px_per_m: float) -> np.ndarray:
        """The board to be printed, grey values."""
        width, height = (round(side * px_per_m) for side in self.size_m)
        return np.asarray(self.made.generateImage((width, height)))


@dataclass(frozen=True)
class Calibration:
    """What a calibration found: the lens over its floor, the RMS of reprojection in pixels, how many views, whose camera.

    Of the floor: in how many places the board lay, and how far corners that were kept back are off (RMS and worst, m; NaN if not
    known). `picture`: exposure, focus and white balance that were set, as the camera read them back; they are set again.
    """

    lens: Lens
    rms_px: float
    views: int
    camera: str
    floor_views: int = 0
    floor_rms_m: float = math.nan
    floor_worst_m: float = math.nan
    picture: Mapping[str, float] = field(default_factory=dict)

    def save(self, path: Path) -> None:
        """Write it as JSON; a reader never sees half a file."""
        lens = self.lens
        content = {
            "camera": self.camera, "size_px": list(lens.size), "rms_px": self.rms_px, "views": self.views,
            "matrix": lens.matrix.tolist(), "distortion": lens.distortion.tolist(),
            "rotation": lens.rotation.tolist(), "shift_m": lens.shift_m.tolist(), "picture": dict(self.picture),
            "floor_views": self.floor_views, "floor_rms_m": _or_none(self.floor_rms_m),
            "floor_worst_m": _or_none(self.floor_worst_m),
        }  # fmt: skip
        unfinished = path.with_name(f".{path.name}.{os.getpid()}.part")
        unfinished.write_text(json.dumps(content, indent=1), encoding="utf-8")
        unfinished.replace(path)


def load_calibration(path: Path) -> Calibration:
    """Read one; HardwareError if it cannot be used."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        arrays = {name: np.array(content[name], np.float64) for name in ("matrix", "distortion", "rotation", "shift_m")}
        width, height = (int(n) for n in content["size_px"])
        lens = Lens(size=(width, height), **arrays)
        rms_m, worst_m = (_or_nan(content.get(name)) for name in ("floor_rms_m", "floor_worst_m"))
        picture = {str(name): float(value) for name, value in dict(content.get("picture", {})).items()}
        views, laid = int(content["views"]), int(content.get("floor_views", 0))
        return Calibration(lens, float(content["rms_px"]), views, str(content["camera"]), laid, rms_m, worst_m, picture)
    except OSError as error:
        raise HardwareError(
            f"the camera has no calibration: cannot read {path} ({error.strerror}). Make one with: bns calibrate"
        ) from error
    except (ValueError, KeyError, TypeError) as error:
        raise HardwareError(f"{path} is no calibration ({error!r}); make it again with: bns calibrate") from error


def _or_none(value: float) -> float | None:
    return None if math.isnan(value) else value


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else float(value)


def check_size(calibration: Calibration, frame: np.ndarray) -> None:
    """HardwareError if the calibration is of pictures of another size, so of another camera or mode."""
    height, width = frame.shape[:2]
    if calibration.lens.size != (width, height):
        was = "{} x {}".format(*calibration.lens.size)
        raise HardwareError(
            f"the calibration is of {calibration.camera} with {was} pixels, the camera gives {width} x {height}: another camera, "
            "or another mode of it. Name its own calibration in the rig, or make one with: bns calibrate"
        )


def check_scale(board: Board, measured_m: float) -> None:
    """HardwareError if the printed board is not as wide as it is taken to be: printers like to scale to the page."""
    width_m = board.size_m[0]
    if abs(measured_m / width_m - 1.0) > _WRONG_SCALE:
        raise HardwareError(
            f"the board is {1000 * measured_m:g} mm wide, not {1000 * width_m:g}: printed at {measured_m / width_m:.1%}. "
            f"Print it without scaling, or continue with --square-mm {1000 * measured_m / board.across:.2f}."
        )


def corners(frame: np.ndarray, board: Board) -> tuple[np.ndarray, np.ndarray] | None:
    """Corners of the board in a frame: points on the board (n, 1, 3), m, and pixels (n, 1, 2); None if too few are seen."""
    found, ids, _, _ = cv2.aruco.CharucoDetector(board.made).detectBoard(frame)
    if ids is None or len(ids) < FEWEST_CORNERS:
        return None
    on_board, px = board.made.matchImagePoints(found, ids)
    return on_board, px


def calibrate(
    frames: Sequence[np.ndarray],
    floors: Sequence[np.ndarray],
    board: Board,
    camera: str,
    picture: Mapping[str, float] | None = None,
) -> Calibration:
    """Calibrate from views of the board, and from frames with the board flat on the floor.

    On the first of those the board's middle lies on the task's origin, its long side east to west, its first corner in the
    north west; on the others it lies elsewhere. `picture`: how the camera was set.
    HardwareError if too few views show it or the fit is bad.
    """
    seen = [pair for pair in (corners(frame, board) for frame in frames) if pair is not None]
    if len(seen) < FEWEST_VIEWS:
        raise HardwareError(
            f"the board was seen in {len(seen)} of {len(frames)} frames; at least {FEWEST_VIEWS} are "
            f"needed. Hold it closer, tilt it, light it evenly; it must have {board.across} x {board.down} squares of "
            f"{1000 * board.square_m:g} mm. The pictures have {frames[0].shape[1]} x {frames[0].shape[0]} pixels: larger ones "
            "(--size) show it from further away."
        )
    height, width = frames[0].shape[:2]
    for floor in floors:
        if floor.shape[:2] != (height, width):
            raise HardwareError(
                f"a picture of the floor has {floor.shape[1]} x {floor.shape[0]} pixels, the views have {width} x {height}: "
                "take all of them with the same camera in the same mode."
            )
    rms, matrix, distortion, turns, _ = cv2.calibrateCamera(
        [p for p, _ in seen], [p for _, p in seen], (width, height), None, None
    )
    if not rms <= WORST_RMS_PX:
        raise HardwareError(f"the calibration fits badly (RMS {rms:.2f} pixels); is the board flat, the focus fixed?")
    if (tilt := _most_tilt(turns)) < LEAST_TILT:
        raise HardwareError(
            f"the views of the board differ in tilt by {math.degrees(tilt):.0f} degrees at most; those that differ by less "
            f"than {math.degrees(LEAST_TILT):.0f} fit many lenses. Film it again, tilted by 20 to 40 degrees to all four sides."
        )
    flat = np.asarray(distortion, np.float64).ravel()[:5]
    pose = floor_pose([_laid(frame, board) for frame in floors], np.asarray(matrix), flat, (width, height))
    if pose.rms_m > _WORST_FLOOR_M:
        raise HardwareError(
            f"corners of the board on the floor that were kept back are off by {1000 * pose.rms_m:.0f} mm RMS, more than "
            f"{1000 * _WORST_FLOOR_M:.0f}: is the board flat, did the camera stay as it was? Film again, in all of the picture."
        )
    return Calibration(pose.lens, float(rms), len(seen), camera, len(floors), pose.rms_m, pose.worst_m, picture or {})


def _most_tilt(turns: Sequence[np.ndarray]) -> float:
    """The greatest angle between the planes of two views, by how the board was turned in each."""
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
    return float(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0)).max())


def _laid(frame: np.ndarray, board: Board) -> Corners:
    """The board as it lies on the floor in a frame."""
    found = corners(frame, board)
    if found is None:
        height, width = frame.shape[:2]
        raise HardwareError(
            "the board is not seen in the picture of the floor; lay it flat, fully in view, evenly lit. The picture has "
            f"{width} x {height} pixels: at {_FINE_PX[0]} x {_FINE_PX[1]} (--size) it is seen from further away."
        )
    on_board, px = found
    width_m, height_m = board.size_m
    # The board's frame has its origin in its upper left corner and y down.
    return Corners((on_board.reshape(-1, 3)[:, :2] - [width_m / 2, height_m / 2]) * [1.0, -1.0], px.reshape(-1, 2))
