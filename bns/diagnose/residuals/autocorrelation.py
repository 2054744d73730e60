"""What repeats itself along time, though no variable shows it: a wheel out of round, a heading that wanders.

Foreseen well, frames are independent. Honest motors are a little faster or slower from one command to the next, and from
trial to trial; that is taken out first, so that it does not look like an autocorrelation: inside commands each command's mean,
between commands each trial's.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit, Problem
from bns.diagnose.settings import DEFAULTS

LAGS = DEFAULTS.residuals.lags
LEAST_ALIKE = DEFAULTS.residuals.least_alike
LEAST_OPPOSED = DEFAULTS.residuals.least_opposed
LEAST_BETWEEN = DEFAULTS.residuals.least_between
LEAST_Z = DEFAULTS.residuals.correlation_z
_CLIP = DEFAULTS.residuals.clip
_DIRECTIONS = ("forward", "left", "heading")


@dataclass(frozen=True)
class Autocorrelation:
    """Correlation of the unforeseen with itself ``lag`` frames (``within`` commands) or commands (``between`` them) before."""

    direction: str
    scale: str
    lag: int
    correlation: float
    z: float

    @property
    def significant(self) -> bool:
        """Too large and too certain to be luck."""
        least = LEAST_BETWEEN
        if self.scale == "within":
            least = LEAST_ALIKE if self.correlation > 0 else LEAST_OPPOSED
        return abs(self.correlation) > least and abs(self.z) > LEAST_Z


def autocorrelations(problem: Problem, fit: Fit) -> list[Autocorrelation]:
    """Every direction and time scale, the largest in proportion to its threshold first."""
    found = []
    for index, direction in enumerate(_DIRECTIONS):
        trials = list(_by_command(problem, fit, index))
        for lag in LAGS:
            found.append(_pooled(direction, "within", lag, [_within(commands, lag) for commands in trials]))
        found.append(_pooled(direction, "between", 1, [_between(commands) for commands in trials]))
    return sorted(found, key=lambda r: (not r.significant, -abs(r.z)))


def _by_command(problem: Problem, fit: Fit, direction: int) -> Iterator[list[Array]]:
    """For each trial the unforeseen of its commands, frame by frame."""
    tracks = problem.predictor.tracks
    for trial, (a, b) in enumerate(pairwise(tracks.first)):
        whitened = np.clip(fit.whitened[a + 1 : b, direction], -_CLIP, _CLIP)
        command = np.searchsorted(np.cumsum(tracks.duration_s[trial]), tracks.t_s[a + 1 : b] - 1e-9)
        yield [whitened[command == c] for c in np.unique(command)]


def _within(commands: list[Array], lag: int) -> tuple[float, float]:
    above = below = 0.0
    for values in commands:
        if len(values) >= lag + 6:
            p, q = _products(values, lag)
            above, below = above + p, below + q
    return above, below


def _between(commands: list[Array]) -> tuple[float, float]:
    means = np.array([values.sum() / np.sqrt(len(values)) for values in commands if len(values) > 5])
    return _products(means, 1) if len(means) >= 4 else (0.0, 0.0)


def _products(values: Array, lag: int) -> tuple[float, float]:
    """Lagged and plain products about the mean; taking off the mean makes the former too small by a known share."""
    centred, n = values - values.mean(), len(values)
    square = float(centred @ centred)
    return float(centred[lag:] @ centred[:-lag]) + (n - lag) * square / ((n - 1) * n), square


def _pooled(direction: str, scale: str, lag: int, sums: list[tuple[float, float]]) -> Autocorrelation:
    pairs = np.array([s for s in sums if s[1] > 0])
    if len(pairs) < 4:
        return Autocorrelation(direction, scale, lag, 0.0, 0.0)
    r = float(pairs[:, 0].sum() / pairs[:, 1].sum())
    se = float(np.std(pairs[:, 0] - r * pairs[:, 1]) * np.sqrt(len(pairs)) / pairs[:, 1].sum())
    return Autocorrelation(direction, scale, lag, r, r / se if se > 0 else 0.0)
