"""What the diagnosis asks of a model of any robot: where it will be at the next frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.predict.luck import Luck
from bns.physics.model import Model


@dataclass(frozen=True)
class Steps:
    """Predicted displacement since the frame before; zeros where a trial begins.

    ``body`` (frames, 3): forward_m, left_m, turn_rad in the frame of the robot at the frame before; ``drift_m``
    (frames, 2): east and north, whatever way the robot faces. ``apart_m`` (frames, k): measured minus predicted distances between
    tracked points, which a pose does not hold; None where there is but one point.
    """

    body: Array
    drift_m: Array
    apart_m: Array | None = None


class Predictor(Protocol):
    """Tracks with all that can be worked out of them once.

    ``way_m`` (frames,): how far the robot was driven since the frame before, or how strongly its drive scatters, in metres.
    ``horizons``: names of the times over which predictions are judged; ``near``: the one of them that curves and worst moments
    are about. ``tracking``: noise of a tracked position (m) and heading (rad), where the tracks tell it by themselves; None: it
    is estimated under a model. ``counted`` (frames,): what each frame counts in a fit; None: all of them 1. ``luck``: what chance
    does to each stretch, where frames are predicted from the begin of theirs; None: where a filter follows the track.
    """

    tracks: Tracks
    way_m: Array
    horizons: tuple[str, ...]
    near: str
    tracking: tuple[float, float] | None
    counted: Array | None
    luck: Luck | None

    def windows(self, horizon: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Frames at which the windows of a horizon begin and end."""

    def steps(self, model: Model) -> Steps:
        """What the model predicts between successive frames."""

    def anchor(self, model: Model, alone: bool = False) -> bool:
        """Models near this one are asked for next: what is worked out roughly is worked out well here.

        ``alone``: only this very one is. Returns whether `steps` may say something else now.
        """

    @property
    def screening(self) -> Predictor | None:
        """The same for few of the tracks, where `steps` is costly: it shows which effects are worth a fit. None: all are."""

    def variables(self) -> dict[str, Array]:
        """Name -> values along which errors may show, one a step of the predictor's own grid, (trials, steps)."""

    def at_frames(self, frames: NDArray[np.int64]) -> dict[str, Array]:
        """`variables` at the times of some frames, (frames,) each."""

    def scores(self) -> Mapping[str, Mapping[str, float]]:
        """How well each output of the model agrees with what was measured, by its name; empty where it has but a path."""
