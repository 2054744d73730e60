"""What the diagnosis asks of a model of any robot: where it will be at the next frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.tracks import Array, Tracks
from bns.physics.model import Model


@dataclass(frozen=True)
class Steps:
    """Predicted displacement since the frame before; zeros where a trial begins.

    ``body`` (frames, 3): forward_m, left_m, turn_rad in the frame of the robot at the frame before; ``drift_m``
    (frames, 2): east and north, whatever way the robot faces.
    """

    body: Array
    drift_m: Array


class Predictor(Protocol):
    """Tracks with all that can be worked out of them once.

    ``way_m`` (frames,): how far the wheels went since the frame before.
    """

    tracks: Tracks
    way_m: Array

    def steps(self, model: Model) -> Steps:
        """What the model predicts between successive frames."""

    def variables(self) -> dict[str, Array]:
        """Name -> values along which errors may show, one a step of the predictor's own grid, (trials, steps)."""

    def at_frames(self, frames: NDArray[np.int64]) -> dict[str, Array]:
        """`variables` at the times of some frames, (frames,) each."""
