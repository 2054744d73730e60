"""What a camera makes of a pose, and which pose it was that a picture shows."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.settings import DEFAULTS
from bns.physics.applied import applied
from bns.physics.model import ActiveEffect
from bns.physics.signals import View

_UNDONE = DEFAULTS.predict.picture_rounds
_NEAR = DEFAULTS.predict.picture_near
_ASIDE = DEFAULTS.predict.picture_aside
_FLAT = DEFAULTS.predict.picture_least_area


def pictured(placed: Sequence[ActiveEffect], poses: Array) -> Array:
    """Poses (frames, 3) as effects of the stage ``measure`` show them."""
    view = View(poses)
    for active in placed:
        view = applied(active.effect, view, active.by_name)
    return view.poses


def undone(picture: Callable[[Array], Array], seen: Array) -> Array:
    """Poses (frames, 3) whose picture is ``seen``: Newton's steps, for those frames that still move.

    Where a picture stretches by more than the places are off, plain repetition would lead away.
    """
    really, left = seen.copy(), np.arange(len(seen))
    for _ in range(_UNDONE):
        at = really[left]
        shown = picture(at)
        off = shown - seen[left]
        east, north, turn = ((picture(at + _ASIDE * np.eye(3)[i]) - shown) / _ASIDE for i in range(3))
        area = east[:, 0] * north[:, 1] - east[:, 1] * north[:, 0]
        area = np.where(np.abs(area) < _FLAT, _FLAT, area)
        x = (off[:, 0] * north[:, 1] - off[:, 1] * north[:, 0]) / area
        y = (off[:, 1] * east[:, 0] - off[:, 0] * east[:, 1]) / area
        turned = off[:, 2] - x * east[:, 2] - y * north[:, 2]
        change = np.stack([x, y, turned / np.maximum(turn[:, 2], _FLAT)], axis=1)
        really[left] -= change
        left = left[np.abs(change).max(axis=1) > _NEAR]
        if not len(left):
            break
    return really
