"""Camera calibration with a ChArUco board, and the file it is kept in."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.tracking.lens import Lens

with extra("robot"):
    import cv2

FEWEST_VIEWS, FEWEST_CORNERS = 8, 8
WORST_RMS_PX = 1.0


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
    """What a calibration found: the lens over its floor, the RMS of reprojection in pixels, how many views, whose camera."""

    lens: Lens
    rms_px: float
    views: int
    camera: str

    def save(self, path: Path) -> None:
        """Write it as JSON; nobody meets half a file."""
        lens = self.lens
        content = {
            "camera": self.camera, "size_px": list(lens.size), "rms_px": self.rms_px, "views": self.views,
            "matrix": lens.matrix.tolist(), "distortion": lens.distortion.tolist(),
            "rotation": lens.rotation.tolist(), "shift_m": lens.shift_m.tolist(),
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
        return Calibration(lens, float(content["rms_px"]), int(content["views"]), str(content["camera"]))
    except OSError as error:
        raise HardwareError(
            f"the camera has no calibration: cannot read {path} ({error.strerror}). Make one with: bns calibrate"
        ) from error
    except (ValueError, KeyError, TypeError) as error:
        raise HardwareError(f"{path} is no calibration ({error!r}); make it anew with: bns calibrate") from error


def check_size(calibration: Calibration, frame: np.ndarray) -> None:
    """HardwareError if the calibration is of pictures of another size, so of another camera or mode."""
    height, width = frame.shape[:2]
    if calibration.lens.size != (width, height):
        was = "{} x {}".format(*calibration.lens.size)
        raise HardwareError(
            f"the calibration is of {calibration.camera} with {was} pixels, the camera gives {width} x {height}: another camera, "
            "or another mode of it. Name its own calibration in the rig, or make one with: bns calibrate"
        )


def corners(frame: np.ndarray, board: Board) -> tuple[np.ndarray, np.ndarray] | None:
    """Corners of the board in a frame: points on the board (n, 1, 3), m, and pixels (n, 1, 2); None if too few are seen."""
    found, ids, _, _ = cv2.aruco.CharucoDetector(board.made).detectBoard(frame)
    if ids is None or len(ids) < FEWEST_CORNERS:
        return None
    on_board, px = board.made.matchImagePoints(found, ids)
    return on_board, px


def calibrate(frames: Sequence[np.ndarray], floor: np.ndarray, board: Board, camera: str) -> Calibration:
    """Calibrate from views of the board, and from one frame with the board flat on the floor.

    On the floor the board's middle lies on the task's origin, its long side east to west, its first corner in the north west.
    HardwareError if too few views show it or the fit is bad.
    """
    seen = [pair for pair in (corners(frame, board) for frame in frames) if pair is not None]
    if len(seen) < FEWEST_VIEWS:
        raise HardwareError(
            f"the board was seen in {len(seen)} of {len(frames)} frames; at least {FEWEST_VIEWS} are "
            f"needed. Hold it closer, tilt it, light it evenly; it must have {board.across} x {board.down} squares of "
            f"{1000 * board.square_m:g} mm."
        )
    height, width = frames[0].shape[:2]
    rms, matrix, distortion, _, _ = cv2.calibrateCamera(
        [p for p, _ in seen], [p for _, p in seen], (width, height), None, None
    )
    if not rms <= WORST_RMS_PX:
        raise HardwareError(f"the calibration fits badly (RMS {rms:.2f} pixels); is the board flat, the focus fixed?")
    rotation, shift_m = _floor_pose(floor, board, matrix, distortion)
    lens = Lens(matrix, np.asarray(distortion, np.float64).ravel()[:5], (width, height), rotation, shift_m)
    return Calibration(lens, float(rms), len(seen), camera)


def _floor_pose(floor: np.ndarray, board: Board, matrix: np.ndarray, distortion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    found = corners(floor, board)
    if found is None:
        raise HardwareError("the board is not seen in the picture of the floor; lay it flat on the origin, fully in view.")
    on_board, px = found
    width, height = board.size_m
    # The board's frame has y down and z into the table; the floor's has y north and z up.
    on_floor = (on_board.reshape(-1, 3) - [width / 2, height / 2, 0.0]) * [1.0, -1.0, -1.0]
    _, turn, shift = cv2.solvePnP(on_floor, px, matrix, distortion)
    rotation, _ = cv2.Rodrigues(turn)
    return np.asarray(rotation), np.asarray(shift, np.float64).ravel()
