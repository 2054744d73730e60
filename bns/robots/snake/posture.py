"""What the change from one cycle to the next does to the markers, from the shapes of the two postures alone.

The dissertation leaves out the change. Here the body that takes up the next cycle's first posture is laid onto the old one so
that its links move as little as they can, in the mean square: if the floor drags every link in proportion to its speed, the pulls
then balance, along the floor and about the body's middle. The drawing of the body is all that is known: nothing is learned.
"""

from __future__ import annotations

import numpy as np

from bns.robots.snake.gait import JOINTS, joint_angles
from bns.robots.snake.path import START_M

LENGTH_M = 1.14
MARKER_GAP_M = float(np.hypot(*np.subtract(START_M[1], START_M[0])))
_LINKS = JOINTS + 1
_PITCH_M = LENGTH_M / _LINKS
_FLAT_M = 0.01
"""A body thinner than this has no plane of its own to lie on: it keeps its roll."""


def changes(cycles: np.ndarray, before: np.ndarray | None = None) -> np.ndarray:
    """What the change into each cycle (n, >= 4) does, (n, 5): yellow to the right and along, green likewise, m, in the frame of
    the markers before it; and the distance of the markers after it. ``before`` (n,): the index of the cycle that was driven
    before each, -1 for the straight body; without it each follows the one above, the first begins straight.
    """
    if before is None:
        before = np.arange(-1, len(cycles) - 1)
    gaits = np.vstack([np.asarray(cycles, np.float64)[:, :4], np.zeros(4)])  # the last one is the straight body
    links, markers = _on_floor(joint_angles(gaits))
    return _moved(links[before], markers[before], links[:-1], markers[:-1])


def _on_floor(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middles of the links (n, 13, 2) and yellow and green (n, 2, 2) as seen from above, around the body's middle."""
    links, markers, up = _shape(angles)
    middle = links.mean(axis=1, keepdims=True)
    links, markers = links - middle, markers - middle
    spread = np.einsum("nki,nkj->nij", links, links) / _LINKS
    _, axes = np.linalg.eigh(spread - _FLAT_M**2 * up[:, :, None] * up[:, None, :])
    normal, ahead = axes[:, :, 0], axes[:, :, 2]
    normal = normal * np.where((normal * up).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    floor = np.stack([ahead, np.cross(normal, ahead)], axis=2)
    return links @ floor, markers @ floor


def _shape(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middles of the links (n, 13, 3), markers (n, 2, 3) and the mean upward direction (n, 3), in the frame of the first link."""
    n = len(angles)
    ahead, left, up = (np.tile(axis, (n, 1)) for axis in np.eye(3))
    end, total_up = np.zeros((n, 3)), np.zeros((n, 3))
    links, markers = np.empty((n, _LINKS, 3)), np.empty((n, 2, 3))
    places = {int(along / _PITCH_M): (which, along) for which, along in enumerate(_marker_places())}
    for k in range(_LINKS):
        if k:
            cos, sin = np.cos(angles[:, k - 1, None]), np.sin(angles[:, k - 1, None])
            if k % 2:  # joints 0, 2, … turn about the upright axis, the others lift
                ahead, left = cos * ahead + sin * left, cos * left - sin * ahead
            else:
                ahead, up = cos * ahead - sin * up, cos * up + sin * ahead
        links[:, k] = end + ahead * (_PITCH_M / 2)
        if k in places:
            which, along = places[k]
            markers[:, which] = end + ahead * (along - k * _PITCH_M)
        end = end + ahead * _PITCH_M
        total_up += up
    return links, markers, total_up / np.linalg.norm(total_up, axis=1, keepdims=True)


def _marker_places() -> tuple[float, float]:
    return (LENGTH_M - MARKER_GAP_M) / 2, (LENGTH_M + MARKER_GAP_M) / 2


def _moved(links: np.ndarray, markers: np.ndarray, next_links: np.ndarray, next_markers: np.ndarray) -> np.ndarray:
    """The next posture turned onto this one for the least sum of squares, and what that does to the markers, (n, 5)."""
    along = (links * next_links).sum(axis=(1, 2))
    across = (next_links[..., 0] * links[..., 1] - next_links[..., 1] * links[..., 0]).sum(axis=1)
    turn = np.arctan2(across, along)
    cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
    x, y = next_markers[..., 0], next_markers[..., 1]
    way = np.stack([cos * x - sin * y, sin * x + cos * y], axis=2) - markers
    line = markers[:, 1] - markers[:, 0]
    ahead = line / np.linalg.norm(line, axis=1, keepdims=True)
    right = np.stack([ahead[:, 1], -ahead[:, 0]], axis=1)
    gap = np.linalg.norm(next_markers[:, 1] - next_markers[:, 0], axis=1)
    parts = [(way[:, marker] * axis).sum(axis=1) for marker in (0, 1) for axis in (right, ahead)]
    return np.column_stack([*parts, gap])
