"""The error along a variable, in bins: root mean square and its 95 % interval, for which whole trials are drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.predict.paired_errors import DRAWS, FEWEST_TRIALS

MOST_BINS = 12
_LEAST_WINDOWS = 8
"""Of a bin, on average."""
_SEED = 0


@dataclass(frozen=True)
class Band:
    """Middle of each bin (bins,), root mean square there, and its interval; NaN where there are too few trials for one."""

    x: Array
    rms: Array
    low: Array
    high: Array


def band(x: Array, error: Array, trials: Array) -> Band:
    """Bins with as many windows each; values that are equal stay together."""
    known = np.isfinite(x) & np.isfinite(error)
    x, error, trial = x[known], error[known], np.unique(trials[known], return_inverse=True)[1]
    if not len(x):
        return Band(*(np.zeros(0) for _ in range(4)))
    bins = int(np.clip(len(x) // _LEAST_WINDOWS, 1, MOST_BINS))
    edges = np.unique(np.quantile(x, np.linspace(0, 1, bins + 1)[1:-1])) if bins > 1 else np.zeros(0)
    place = np.unique(np.searchsorted(edges, x), return_inverse=True)[1]
    shape = trial.max() + 1, place.max() + 1
    squares, counts = np.zeros(shape), np.zeros(shape)
    np.add.at(squares, (trial, place), error**2)
    np.add.at(counts, (trial, place), 1)
    middle = np.bincount(place, x) / np.bincount(place)
    rms = np.sqrt(squares.sum(axis=0) / counts.sum(axis=0))
    if len(squares) < FEWEST_TRIALS:
        return Band(middle, rms, np.full_like(rms, np.nan), np.full_like(rms, np.nan))
    drawn = np.random.default_rng(_SEED).multinomial(len(squares), np.full(len(squares), 1 / len(squares)), size=DRAWS)
    with np.errstate(invalid="ignore"):  # no trial of a bin was drawn: that draw says nothing of it
        low, high = np.nanquantile(np.sqrt((drawn @ squares) / (drawn @ counts)), [0.025, 0.975], axis=0)
    return Band(middle, rms, low, high)
