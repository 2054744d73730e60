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

from bns.diagnose.data.tracking_noise import robust_sd
from bns.diagnose.estimate.fit import Fit, Problem
from bns.diagnose.settings import DEFAULTS

WIDTH = DEFAULTS.residuals.outlier_frames
FAR = DEFAULTS.residuals.outlier_far
TRIALS = DEFAULTS.residuals.outlier_trials
JUMP = DEFAULTS.residuals.fault_jump
WAYS = DEFAULTS.residuals.fault_ways
TURN = DEFAULTS.residuals.fault_turn
_CLIP = DEFAULTS.residuals.clip


@dataclass(frozen=True)
class Outlier:
    """The worst window of a trial that has one which stands out: when it began, and how far off it is."""

    trial: str
    t_s: float
    size: float


def outliers(problem: Problem, fit: Fit) -> list[Outlier]:
    """One for every trial with a window that stands out, the worst first; none where fewer than `TRIALS` have one."""
    tracks = problem.predictor.tracks
    start = _windows(tracks.first)
    start = start[~_near(_jumped(problem, fit), start)]
    if not len(start):
        return []
    whitened = np.clip(fit.whitened, -_CLIP, _CLIP)
    sums = whitened[start[:, None] + np.arange(WIDTH)].sum(axis=1) / np.sqrt(WIDTH)
    usual = robust_sd(sums, axis=0)
    size = np.abs(sums / np.maximum(usual, 1e-9)).max(axis=1)
    order = [i for i in np.argsort(-size) if size[i] > FAR]
    worst = {int(tracks.trial[start[i]]): i for i in reversed(order)}
    found = [Outlier(tracks.names[t], float(tracks.own_s[start[i]]), float(size[i])) for t, i in worst.items()]
    return sorted(found, key=lambda o: -o.size) if len(found) >= TRIALS else []


def _windows(first: NDArray[np.int64]) -> NDArray[np.int64]:
    """The frame where each window begins; windows do not overlap."""
    return np.concatenate([np.arange(a + 1, b - WIDTH + 1, WIDTH) for a, b in pairwise(first)]).astype(np.int64)


def _jumped(problem: Problem, fit: Fit) -> NDArray[np.bool_]:
    """Frames (frames,) that are farther off than any robot gets within one."""
    possible = JUMP + WAYS * problem.predictor.way_m / problem.pose_filter.noise[0]
    off = np.abs(fit.whitened)
    return np.asarray((off[:, :2].max(axis=1) > possible) | (off[:, 2] > TURN))


def _near(frames: NDArray[np.bool_], start: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Windows (windows,) with such a frame in them or less than a window away."""
    count = np.concatenate([[0], np.cumsum(frames)])
    return np.asarray(count[np.minimum(start + 2 * WIDTH, len(frames))] > count[np.maximum(start - WIDTH, 0)])
