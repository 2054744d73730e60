"""Where a body is, from where its markers are seen on the floor plane: the rigid motion with the least squared error."""

from __future__ import annotations

from itertools import permutations

import numpy as np


def fit(markers_m: np.ndarray, seen_m: np.ndarray) -> tuple[np.ndarray, float]:
    """Pose (3,) of a body with `markers_m` (n, 2: to the right, ahead) seen at `seen_m` (n, 2: x, y), and the RMS error, m."""
    # As complex numbers: ahead is 1, right is -i, turned by the heading's unit.
    body = markers_m[:, 1] - 1j * markers_m[:, 0]
    world = seen_m[:, 0] + 1j * seen_m[:, 1]
    turn = np.vdot(body - body.mean(), world - world.mean())
    unit = turn / abs(turn) if abs(turn) > 0 else 1.0
    place = world.mean() - unit * body.mean()
    rms = float(np.sqrt(np.mean(np.abs(place + unit * body - world) ** 2)))
    return np.array([place.real, place.imag, np.angle(unit)]), rms


def best_fit(markers_m: np.ndarray, seen_m: np.ndarray, worst_m: float) -> tuple[np.ndarray, float] | None:
    """The pose whose markers fit best among all ways to name the lights; None if none fits within `worst_m`.

    A mirrored triangle never fits: the motion turns and shifts only. So lights may change places, and reflections be among them.
    """
    count = len(markers_m)
    found = [fit(markers_m, seen_m[list(order)]) for order in permutations(range(len(seen_m)), count)]
    best = min(found, key=lambda pose_and_rms: pose_and_rms[1], default=None)
    return best if best is not None and best[1] <= worst_m else None


def placed(markers_m: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Where the markers (n, 2) of a body at `pose` (3,) are on the floor plane, (n, 2): the inverse of `fit`."""
    world = (pose[0] + 1j * pose[1]) + np.exp(1j * pose[2]) * (markers_m[:, 1] - 1j * markers_m[:, 0])
    return np.column_stack([world.real, world.imag])
