"""The spread of numbers of which single ones are faults."""

from __future__ import annotations

import numpy as np

from bns.diagnose.data.tracks import Array

_NORMAL = 0.6745
"""Median of a standard normal number's size."""


def robust_sd(off: Array, axis: int | None = None) -> Array:
    """Standard deviation about zero by the median of the sizes: single faults of a marker do not count."""
    return np.asarray(np.median(np.abs(off), axis=axis) / _NORMAL)
