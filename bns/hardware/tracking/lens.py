"""A camera as OpenCV describes it, and what of the world each pixel looks at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bns.extras import extra

with extra("robot"):
    import cv2


@dataclass(frozen=True)
class Lens:
    """A calibrated camera above a floor.

    matrix (3, 3) in pixels, distortion (5,), size (width, height) in pixels. rotation (3, 3) and shift_m (3,) take points of the
    floor's frame (x east, y north, z up, metres) to the camera's.
    """

    matrix: np.ndarray
    distortion: np.ndarray
    size: tuple[int, int]
    rotation: np.ndarray
    shift_m: np.ndarray

    def on_plane(self, px: np.ndarray, height_m: float) -> np.ndarray:
        """Where the rays of pixels (n, 2) meet the plane `height_m` above the floor, (n, 2): x, y.

        A marker on a robot is seen further out than the floor under it, by r·h/(H−h); here it is taken where it is.
        """
        if not len(px):
            return np.empty((0, 2))
        return self.plane_hit(px, np.eye(3), np.array([0.0, 0.0, height_m]))

    def plane_hit(self, px: np.ndarray, turn: np.ndarray, origin_m: np.ndarray) -> np.ndarray:
        """The same for any plane: `turn` (3, 3) has its axes as columns in the floor's frame; NaN behind the camera."""
        return self.rays_hit(self.straightened(px), turn, origin_m)

    def straightened(self, px: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) without distortion, as tangents of their angles to the camera's axis."""
        found = cv2.undistortPoints(px.reshape(-1, 1, 2).astype(np.float64), self.matrix, self.distortion)
        return np.asarray(found).reshape(-1, 2)

    def rays_hit(self, straight: np.ndarray, turn: np.ndarray, origin_m: np.ndarray) -> np.ndarray:
        """`plane_hit` of pixels that are straightened already."""
        rays = np.column_stack([straight, np.ones(len(straight))]) @ self.rotation @ turn
        eye = turn.T @ (-self.rotation.T @ self.shift_m - origin_m)
        with np.errstate(divide="ignore", invalid="ignore"):
            along = -eye[2] / rays[:, 2]
            hit = eye[:2] + along[:, None] * rays[:, :2]
        hit[~(along > 0)] = np.nan
        return np.asarray(hit)

    def px(self, points_m: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) of points (n, 3) in the floor's frame."""
        turn, _ = cv2.Rodrigues(self.rotation)
        found, _ = cv2.projectPoints(points_m.astype(np.float64), turn, self.shift_m, self.matrix, self.distortion)
        return found.reshape(-1, 2)


def looking_down(
    matrix: np.ndarray, distortion: np.ndarray, size: tuple[int, int], height_m: float, tilt_rad: float = 0.0
) -> Lens:
    """A camera `height_m` above the origin, the picture's top to the north, tilted about its x axis."""
    down = np.diag([1.0, -1.0, -1.0])
    cos, sin = np.cos(tilt_rad), np.sin(tilt_rad)
    rotation = np.array([[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]]) @ down
    eye = np.array([0.0, -height_m * np.tan(tilt_rad), height_m])
    return Lens(matrix, distortion, size, rotation, -rotation @ eye)
