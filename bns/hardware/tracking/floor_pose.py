"""Where a camera hangs above the floor, from a board laid flat on it: on the origin first, then anywhere else.

One small board says little about how the camera is tilted: far from it the floor is a centimetre off. Laid at several places
it spans the surface, and where it lay besides the first time (a shift and a turn in the plane) is found along with the
camera's six numbers by least squares of the pixels. A quarter of the corners has no part in that and says how well the floor is
known where the board lay.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from bns.extras import extra
from bns.hardware.tracking.lens import Lens
from bns.hardware.tracking.rigid import fit, placed

with extra("robot"):
    import cv2

_KEPT_BACK = 4  # every fourth corner


class Corners(NamedTuple):
    """A board seen: its corners from its middle (n, 2), m, to the right and up on it, and their pixels (n, 2)."""

    board_m: np.ndarray
    px: np.ndarray


class FloorPose(NamedTuple):
    """Camera above the floor, and how far corners that had no part in it are from where they should be, m."""

    lens: Lens
    rms_m: float
    worst_m: float


def floor_pose(seen: Sequence[Corners], matrix: np.ndarray, distortion: np.ndarray, size: tuple[int, int]) -> FloorPose:
    """The camera over the floor; in the first view the board's middle lies on the origin, its top to the north."""
    used = [Corners(view.board_m[(keep := _used(len(view.px)))], view.px[keep]) for view in seen]
    begun = _one_view(used[0], matrix, distortion, size)
    places = [_NORTH, *(_place(begun, view) for view in used[1:])]
    if len(used) > 1:
        begun, places = _together(begun, used, places)
    errors = [_apart(begun, view, place) for view, place in zip(seen, places, strict=True)]
    return FloorPose(begun, float(np.sqrt(np.mean(np.concatenate(errors) ** 2))), float(np.concatenate(errors).max()))


_NORTH = np.array([0.0, 0.0, np.pi / 2])


def _used(count: int) -> np.ndarray:
    return np.arange(count) % _KEPT_BACK != _KEPT_BACK - 1


def _on_floor(board_m: np.ndarray, place: np.ndarray) -> np.ndarray:
    return np.column_stack([placed(board_m, place), np.zeros(len(board_m))])


def _one_view(view: Corners, matrix: np.ndarray, distortion: np.ndarray, size: tuple[int, int]) -> Lens:
    _, turn, shift = cv2.solvePnP(_on_floor(view.board_m, _NORTH), view.px.reshape(-1, 1, 2), matrix, distortion)
    return Lens(matrix, distortion, size, np.asarray(cv2.Rodrigues(turn)[0]), np.asarray(shift, np.float64).ravel())


def _place(lens: Lens, view: Corners) -> np.ndarray:
    """Where the board lay, (3,): x_m, y_m, direction of its top."""
    return fit(view.board_m, lens.on_plane(view.px, 0.0))[0]


def _together(begun: Lens, used: Sequence[Corners], places: Sequence[np.ndarray]) -> tuple[Lens, list[np.ndarray]]:
    """The camera and the places of all views but the first, from all of them at once."""

    def unpacked(values: np.ndarray) -> tuple[Lens, list[np.ndarray]]:
        rotation = np.asarray(cv2.Rodrigues(values[:3])[0])
        return Lens(begun.matrix, begun.distortion, begun.size, rotation, values[3:6]), [_NORTH, *values[6:].reshape(-1, 3)]

    def misfit(values: np.ndarray) -> np.ndarray:
        lens, there = unpacked(values)
        pairs = zip(used, there, strict=True)
        return np.concatenate([(lens.px(_on_floor(view.board_m, place)) - view.px).ravel() for view, place in pairs])

    turn, _ = cv2.Rodrigues(begun.rotation)
    found = least_squares(misfit, np.concatenate([turn.ravel(), begun.shift_m, *places[1:]]), x_scale="jac", method="lm")
    return unpacked(found.x)


def _apart(lens: Lens, view: Corners, place: np.ndarray) -> np.ndarray:
    """How far the corners that were kept back are from where they should be, m."""
    back = ~_used(len(view.px))
    return np.asarray(np.linalg.norm(lens.on_plane(view.px[back], 0.0) - placed(view.board_m[back], place), axis=1))
