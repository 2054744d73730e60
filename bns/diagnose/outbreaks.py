"""Moments that stand out: nothing is wrong most of the time, and now and then a great deal is.

A patch of floor that few trials cross, a wheel that slips, a cable that snags: too few trials show it for a curve along any
variable to be certain, and what is not foreseen there passes for scatter of the drive. But honest scatter is alike
everywhere: no window of frames is many times as far off as most are.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.fit import Fit, Problem
from bns.diagnose.tracks import Array

WIDTH = 12
"""Frames a window: about half a second at camera rate. What a marker does for a single frame hardly counts in it."""
FAR = 6.0
"""A window stands out that is so many times as far off as most are (by the median, as standard deviations)."""
TRIALS = 3
"""So many trials at least must have such a window: a robot that was kicked once tells nothing of its model."""
_CLIP = 4.0
_NORMAL = 0.6745
"""Median of a standard normal number's size."""


@dataclass(frozen=True)
class Outbreak:
    """The worst window of a trial that has one which stands out: when it began, and how far off it is."""

    trial: str
    t_s: float
    size: float


def outbreaks(problem: Problem, fit: Fit) -> list[Outbreak]:
    """One for every trial with a window that stands out, the worst first; none where fewer than `TRIALS` have one."""
    tracks = problem.predictor.tracks
    sums, start = _windows(np.clip(fit.white, -_CLIP, _CLIP), tracks.first)
    if not len(sums):
        return []
    usual = np.median(np.abs(sums), axis=0) / _NORMAL
    size = np.abs(sums / np.maximum(usual, 1e-9)).max(axis=1)
    order = [i for i in np.argsort(-size) if size[i] > FAR]
    worst = {int(tracks.trial[start[i]]): i for i in reversed(order)}
    found = [Outbreak(tracks.names[t], float(tracks.t_s[start[i]]), float(size[i])) for t, i in worst.items()]
    return sorted(found, key=lambda o: -o.size) if len(found) >= TRIALS else []


def _windows(white: Array, first: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Sums over windows that do not overlap, in standard deviations, (windows, 3), and the frame where each begins."""
    begins = [np.arange(a + 1, b - WIDTH + 1, WIDTH) for a, b in pairwise(first)]
    start = np.concatenate(begins).astype(np.int64)
    return white[start[:, None] + np.arange(WIDTH)].sum(axis=1) / np.sqrt(WIDTH), start
