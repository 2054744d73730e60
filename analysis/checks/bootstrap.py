"""What the checks share: intervals by bootstrap over seeds, and how they are written."""

from __future__ import annotations

import math

import numpy as np

from analysis.importance import DRAWS, by_value
from analysis.intervals import FEWEST_SEEDS, band, ratios, resampled, wilson
from analysis.results import Results
from analysis.selection import Selection
from analysis.verdicts import Checked, within


def whole_and_samples(sums: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """Sums over counts (seeds, ...): of all seeds (...), and of each bootstrap sample (draws, ...); None from too few seeds."""
    whole = ratios(np.ones((1, len(sums))), sums, counts)[0]
    return whole, ratios(resampled(len(sums), DRAWS), sums, counts) if len(sums) >= FEWEST_SEEDS else None


def ends(samples: np.ndarray | None) -> tuple[float, float]:
    """Ends of the 95 % interval of samples (draws,); NaN without any."""
    if samples is None:
        return math.nan, math.nan
    low, high = band(samples)
    return float(low), float(high)


def bootstrapped(sums: np.ndarray, counts: np.ndarray) -> tuple[float, float]:
    """Ends of the 95 % interval of total sum over total count, both (seeds,); NaN from too few seeds."""
    return ends(whole_and_samples(sums, counts)[1])


def mean_rates(store: Results, chosen: Selection, task: str, parameter: str) -> tuple[np.ndarray, np.ndarray | None, list]:
    """Success of each value over all evaluations: of all seeds (values,), of bootstrap samples (draws, values); the values."""
    sums, counts, values, _ = by_value(store, chosen, task, parameter)
    whole, samples = whole_and_samples(sums.sum(axis=2), counts.sum(axis=2))
    return np.nan_to_num(whole), None if samples is None else np.nan_to_num(samples), values


def mostly(claim: str, holds: np.ndarray) -> Checked:
    """More than half of some combinations."""
    low, high = (float(end) for end in wilson(holds.sum(), len(holds)))
    return Checked(claim, f"{holds.sum()} of {len(holds)}", within(low, high, 0.5, 1.0))


def interval(low: float, high: float, form: str) -> str:
    """`` (low to high)``; nothing where it is not known."""
    return "" if math.isnan(low) or math.isnan(high) else f" ({low:{form}} to {high:{form}})"
