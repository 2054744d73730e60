"""The spread of numbers of which single ones are faults."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from bns.diagnose.data.tracks import Array
from bns.diagnose.settings import DEFAULTS

_NORMAL = 0.6745
"""Median of a standard normal number's size."""
_FARTHEST = DEFAULTS.data.noise_trimmed
_ROUNDS = DEFAULTS.data.noise_rounds


def robust_sd(off: Array, axis: int | None = None) -> Array:
    """Standard deviation about zero by the median of the sizes: single faults of a marker do not count."""
    return np.asarray(np.median(np.abs(off), axis=axis) / _NORMAL)


def trimmed_sd(off: Array) -> float:
    """The same of those that lie no farther off than `noise_trimmed` of it: known from half as many numbers as by the median."""
    sizes, inside = np.abs(off), 2.0 * ndtr(_FARTHEST) - 1.0
    kept = 1.0 - 2.0 * _FARTHEST * np.exp(-(_FARTHEST**2) / 2.0) / np.sqrt(2.0 * np.pi) / inside  # variance of a normal number
    sd = float(robust_sd(off))
    for _ in range(_ROUNDS):
        sd = float(np.sqrt((sizes[sizes <= _FARTHEST * sd] ** 2).mean() / kept))
    return sd
