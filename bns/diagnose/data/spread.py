"""Does the robot move at all, by its poses? Noise of the tracker and single wrong poses are no motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from bns.diagnose.settings import DEFAULTS
from bns.measurements import POSE

_FAR_M, _FAR_RAD = DEFAULTS.data.at_rest
_DRIFT_M, _DRIFT_RAD, _SURE = DEFAULTS.data.drifts
_LAST = DEFAULTS.data.drifts_last


def moved(table: pd.DataFrame, trials: Sequence[tuple[str, np.ndarray]]) -> bool:
    """Whether the poses of a trial spread in position or heading. ``trials``: names and row numbers."""
    poses = table[list(POSE)].to_numpy(dtype=float)
    return any(_spreads(poses[rows]) for _, rows in trials)


def _spreads(pose: np.ndarray) -> bool:
    """The same for the poses (n, 3) of one trial: the middle nine tenths of each number count."""
    seen = pose[np.isfinite(pose).all(axis=1)]
    if len(seen) < 2:
        return False
    values = np.column_stack([seen[:, :2], np.unwrap(seen[:, 2])])
    low, high = np.percentile(values, (5, 95), axis=0)
    return bool(np.hypot(*(high - low)[:2]) > _FAR_M or (high - low)[2] > _FAR_RAD)


def drifts(pose: np.ndarray) -> bool:
    """Whether the last of some poses (n, 3) lie elsewhere than their first third, by more than the noise: the robot moves.

    The noise is that of differences between neighbours, to which a moving robot adds little.
    """
    seen = pose[np.isfinite(pose).all(axis=1)]
    third = len(seen) // 3
    if not third:
        return False
    last = min(third, _LAST)
    values = np.column_stack([seen[:, :2], np.unwrap(seen[:, 2])])
    way = np.abs(values[-last:].mean(axis=0) - values[:third].mean(axis=0))
    noise = np.median(np.abs(np.diff(values, axis=0)), axis=0)
    clear = way > _SURE * noise * np.sqrt(1.0 / third + 1.0 / last)
    return bool((clear & (way > (_DRIFT_M, _DRIFT_M, _DRIFT_RAD))).any())
