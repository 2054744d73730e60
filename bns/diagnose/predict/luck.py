"""What chance does to every stretch of a robot on joints: the same luck moves one gait by millimetres and another by decimetres.

A floor that is a little rougher, that falls a little, links that grip unevenly, steps of the simulation that are too long: each
is simulated once, and what it moves is a direction in which this stretch scatters. How strongly is estimated later.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.bodies.stretches import StretchTracks, apart, poses_of
from bns.diagnose.data.tracks import Array


@dataclass(frozen=True)
class Luck:
    """Directions in which stretches scatter.

    ``columns`` (frames, 3 + k, m): what each usual piece of luck changes of the pose since the stretch's begin (forward_m,
    left_m, heading_rad) and of the k distances between tracked points; ``kind`` (m,): of which kind each is, 0, 1, ...; pieces
    of a kind are equally strong. ``stretch`` (frames,), ``begins`` (stretches,): which frames belong together.
    """

    columns: Array
    kind: NDArray[np.int64]
    stretch: NDArray[np.int64]
    begins: NDArray[np.int64]

    @property
    def kinds(self) -> int:
        """How many there are."""
        return int(self.kind.max()) + 1 if len(self.kind) else 0

    def only(self, frames: NDArray[np.int64], tracks: StretchTracks) -> Luck:
        """Of some of the frames, those of ``tracks``."""
        return replace(self, columns=self.columns[frames], stretch=tracks.stretch, begins=tracks.begins)


def luck_of(tracks: StretchTracks, sound_m: Array, pieces: Sequence[Sequence[Array]]) -> Luck:
    """Of tracked points (frames, sites, 2) as they should be, and with each piece of luck, by kind."""
    usual = _seen(tracks, sound_m)
    columns = [_difference(_seen(tracks, points), usual) for kind in pieces for points in kind]
    kind = np.repeat(np.arange(len(pieces)), [len(of) for of in pieces])
    stacked = np.stack(columns, axis=2) if columns else np.zeros((*usual.shape, 0))
    return Luck(stacked, kind.astype(np.int64), tracks.stretch, tracks.begins)


def since_begin(pose: Array, begins: NDArray[np.int64], stretch: NDArray[np.int64]) -> Array:
    """Poses (frames, 3) as seen from the first of their stretch: forward_m, left_m, heading_rad."""
    first = pose[begins][stretch]
    dx, dy = (pose[:, :2] - first[:, :2]).T
    cos, sin = np.cos(first[:, 2]), np.sin(first[:, 2])
    return np.column_stack([cos * dx + sin * dy, cos * dy - sin * dx, wrapped(pose[:, 2] - first[:, 2])])


def wrapped(angle: Array) -> Array:
    """An angle between -pi and pi."""
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)


def _seen(tracks: StretchTracks, points_m: Array) -> Array:
    """Pose since the begin and distances, (frames, 3 + k)."""
    return np.column_stack([since_begin(poses_of(points_m), tracks.begins, tracks.stretch), apart(points_m)])


def _difference(changed: Array, usual: Array) -> Array:
    out = changed - usual
    out[:, 2] = wrapped(out[:, 2])
    return out
