"""Intervals of shares and of curves, and what a figure says of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

INTERVALS = "pointwise 95 % Wilson intervals"
"""For the note on a figure."""
INDEPENDENCE = "pointwise; runs taken as independent, though combinations share their seeds"
"""For its caption: all combinations have the luck of a seed in common, which the intervals know nothing of."""
POOLED = "bands: pointwise 95 %, the wider of Wilson's interval and a bootstrap over seeds"
"""For curves that pool combinations: with a seed's luck in common, they scatter more than independent runs would."""
BOOTSTRAP = "pointwise 95 % bootstrap intervals over seeds"
DRAWS = 1000
Z = 1.959963984540054
"""The 97.5 % point of the normal distribution."""
FEWEST_SEEDS = 5
"""From fewer seeds no bootstrap interval is given: a handful of values says little of how far others would lie."""
_LARGEST = 1 - 1e-12
"""Correlation that Fisher's transformation is still finite for."""
_STREAM = 20260101
"""Seed of the bootstrap: the same results give the same intervals."""


def wilson(successes: Any, runs: Any) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the Wilson 95 % interval of a share (E. B. Wilson, 1927), each as the arguments, in 0..1."""
    # Written out, because the library that has it (statsmodels, which the tests compare with) takes longer to load than a
    # figure takes to draw.
    k, n = np.asarray(successes, float), np.asarray(runs, float)
    centre = (k + Z**2 / 2) / (n + Z**2)
    half = Z * np.sqrt(k * (n - k) / n + Z**2 / 4) / (n + Z**2)
    return np.clip(centre - half, 0, k / n), np.clip(centre + half, k / n, 1)


def rank_correlation(first: Any, second: Any) -> tuple[float, float, float]:
    """Spearman's rank correlation of two columns (n,), and the ends of its 95 % interval; NaN from fewer than four.

    Fisher's transformation, with the variance of D. G. Bonett and T. A. Wright (Psychometrika 65, 2000): (1 + r^2/2) / (n - 3).
    """
    from scipy.stats import spearmanr  # noqa: PLC0415  # slow to load

    found, n = float(spearmanr(first, second).statistic), len(first)
    if n < 4:
        return found, math.nan, math.nan
    reach = Z * math.sqrt((1 + found**2 / 2) / (n - 3))
    middle = math.atanh(max(-_LARGEST, min(_LARGEST, found)))
    return found, math.tanh(middle - reach), math.tanh(middle + reach)


def resampled(seeds: int, draws: int = DRAWS) -> np.ndarray:
    """How often each seed stands in each of ``draws`` bootstrap samples, (draws, seeds).

    Seeds are the unit: all combinations of a seed have its luck in common and are drawn together.
    """
    random = np.random.default_rng(_STREAM)
    return random.multinomial(seeds, np.full(seeds, 1 / seeds), size=draws).astype(float)


def ratios(weights: np.ndarray, sums: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Sums over counts in each bootstrap sample: (draws, seeds) and (seeds, ...) give (draws, ...); NaN for 0 / 0."""
    above, below = (np.tensordot(weights, values, axes=1) for values in (sums, counts))
    return np.divide(above, below, out=np.full(above.shape, np.nan), where=below > 0)


def band(samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the 95 % percentile interval over the first axis; NaN where some sample is not known."""
    low, high = np.quantile(samples, (0.025, 0.975), axis=0)
    return low, high


def bootstrap(sums: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the 95 % interval of total sum over total count, both (seeds, ...); NaN from fewer than FEWEST_SEEDS seeds."""
    if len(sums) < FEWEST_SEEDS:
        nothing = np.full(sums.shape[1:], np.nan)
        return nothing, nothing.copy()
    return band(ratios(resampled(len(sums)), sums, counts))


def pooled(rows: pd.DataFrame, curve: Sequence[str]) -> pd.DataFrame:
    """Of each curve and evaluation: runs, successes, and ``low`` and ``high`` as in `POOLED`.

    rows: a row a curve, evaluation and seed, with root_seed, seed, runs and successes. ``curve``: the columns that name a curve.
    From fewer than `FEWEST_SEEDS` seeds, or where all runs agree, Wilson's interval is the wider one.
    """
    keys = [*curve, "evaluation"]
    totals = rows.groupby(keys, as_index=False)[["runs", "successes"]].sum()
    low, high = wilson(totals.successes, totals.runs)
    place, seed = (rows.groupby(names).ngroup().to_numpy() for names in (keys, ["root_seed", "seed"]))
    numbers = rows[["runs", "successes"]].to_numpy(float)
    for _, own in totals.groupby(list(curve)):
        at = own.index.to_numpy()
        mine = np.isin(place, at)
        seeds, nth = np.unique(seed[mine], return_inverse=True)
        sums = np.zeros((len(seeds), len(at), 2))
        np.add.at(sums, (nth, np.searchsorted(at, place[mine])), numbers[mine])
        ends = bootstrap(sums[..., 1], sums[..., 0])
        low[at], high[at] = np.fmin(low[at], ends[0]), np.fmax(high[at], ends[1])
    return totals.assign(low=low, high=high)


def mean_interval(mean: Any, spread: Any, n: Any) -> tuple[np.ndarray, np.ndarray]:
    """Ends of Student's 95 % interval of a mean of ``n`` values with standard deviation ``spread``."""
    from scipy.stats import t  # noqa: PLC0415  # slow to load, and few figures need it

    half = t.ppf(0.975, np.maximum(np.asarray(n) - 1, 1)) * np.asarray(spread) / np.sqrt(n)
    return np.asarray(mean) - half, np.asarray(mean) + half
