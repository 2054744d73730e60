"""Does the robot move at all, by its poses? Noise of the tracker and single wrong poses are no motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from bns.diagnose.settings import DEFAULTS
from bns.measurements import POSE

_FAR_M, _FAR_RAD = DEFAULTS.data.at_rest


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
