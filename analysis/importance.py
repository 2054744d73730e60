"""How much each parameter matters for success at the last evaluation: three measures, all with seeds as the unit.

The *gap* is the dissertation's: how far the curves of a parameter's values lie apart at most. The *variance share* is functional
analysis of variance on the success rates of the combinations: on a whole grid the main effects of a type II analysis of
variance, less what the chance of single runs adds to them. The *permutation importance* is how much worse a regression tree
predicts success on seeds that it has not seen when the values of the parameter are shuffled.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from analysis.intervals import FEWEST_SEEDS, band, ratios, resampled
from analysis.labels import CELL
from analysis.outcomes import successes_by_seed
from analysis.ranking import by_seed_array
from analysis.results import Results, remembered
from analysis.selection import Selection

SPLITS = 12
"""Halvings of the seeds for the permutation importance."""
LEAF = 3
"""Combinations in a leaf of the tree, at least: single ones are mostly chance."""
DRAWS = 400
_STREAM = 5


@remembered
def by_value(store: Results, chosen: Selection, task: str, parameter: str) -> tuple[np.ndarray, np.ndarray, list, list]:
    """Successes and runs (seeds, values, evaluations), and the values and evaluations in order."""
    rows = successes_by_seed(store, chosen, ("evaluation", parameter), f"task = '{task}'")
    runs, successes = (
        rows.pivot_table(index=["root_seed", "seed"], columns=[parameter, "evaluation"], values=name, fill_value=0)
        for name in ("runs", "successes")
    )
    shape = (len(runs), rows[parameter].nunique(), rows.evaluation.nunique())
    counts, sums = (table.to_numpy(float).reshape(shape) for table in (runs, successes))
    return sums, counts, sorted(rows[parameter].unique()), sorted(rows.evaluation.unique())


def largest_gap(store: Results, chosen: Selection, task: str, parameter: str, *, at_last: bool = False) -> dict[str, float]:
    """The widest gap between two values' success rates, in points, where it is, and its interval; ``at_last``: at the last
    evaluation.

    The interval is that of the difference between these two values at this evaluation. Picking the widest makes small gaps
    look larger than they are, so its lower end is lowered to what the gap exceeds the widest gap of equal values by (in 95 % of
    the bootstrap samples, their means taken away). Keys: points, low, high, evaluation, best, worst.
    """
    sums, counts, values, evaluations = by_value(store, chosen, task, parameter)
    rates = 100 * ratios(np.ones((1, len(counts))), sums, counts)[0]
    widest = len(evaluations) - 1 if at_last else np.nanargmax(np.nanmax(rates, axis=0) - np.nanmin(rates, axis=0))
    best = int(np.nanargmax(rates[:, widest]))
    worst = len(values) - 1 - int(np.nanargmin(rates[::-1, widest]))  # another than the best even where all are as good
    points, low, high = float(rates[best, widest] - rates[worst, widest]), math.nan, math.nan
    if len(counts) >= FEWEST_SEEDS:
        looked = slice(widest, None) if at_last else slice(None)
        every = 100 * ratios(resampled(len(counts), DRAWS), sums[:, :, looked], counts[:, :, looked])
        equal = every - rates[:, looked]
        by_chance = float(np.nanquantile(np.nanmax(np.nanmax(equal, axis=1) - np.nanmin(equal, axis=1), axis=1), 0.95))
        drawn = every[:, :, 0 if at_last else widest]
        low, high = map(float, band(drawn[:, best] - drawn[:, worst]))
        low = min(low, max(points - by_chance, 0.0))
    return {
        "points": points, "low": low, "high": high,
        "evaluation": float(evaluations[widest]), "best": float(values[best]), "worst": float(values[worst]),
    }  # fmt: skip


@remembered
def at_the_end(store: Results, chosen: Selection, task: str) -> tuple[pd.DataFrame, np.ndarray, np.ndarray]:
    """Combinations (rows), and successes and runs of each seed at the last evaluation, both (seeds, combinations)."""
    rows = successes_by_seed(store, chosen, CELL, f"task = '{task}' AND last")
    cells = rows[list(CELL)].drop_duplicates().sort_values(list(CELL)).reset_index(drop=True)
    numbered = rows.merge(cells.reset_index(names="cell"), on=list(CELL))
    (sums, _), (counts, _) = (by_seed_array(numbered, name, "cell") for name in ("successes", "runs"))
    return cells, sums, counts


def sums_of_squares(cells: pd.DataFrame, rates: np.ndarray, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Type II sums of squares of the main effects (..., parameters), and the total (...), of rates (..., combinations).

    That of a parameter is what taking it away from the model of all main effects costs.
    """
    whole = _residual(cells, names, rates)
    total = ((rates - rates.mean(axis=-1, keepdims=True)) ** 2).sum(axis=-1)
    lost = [_residual(cells, [other for other in names if other != name], rates) - whole for name in names]
    return np.stack(lost, axis=-1), total


def _residual(cells: pd.DataFrame, names: Sequence[str], rates: np.ndarray) -> np.ndarray:
    columns = [np.ones((len(cells), 1))]
    columns += [(cells[[name]].to_numpy() == sorted(cells[name].unique())[1:]).astype(float) for name in names]
    u, singular, _ = np.linalg.svd(np.hstack(columns), full_matrices=False)
    basis = u[:, singular > 1e-9 * singular[0]]
    return np.asarray(((rates - rates @ basis @ basis.T) ** 2).sum(axis=-1))


def chance(sums: np.ndarray, counts: np.ndarray) -> float:
    """Variance that a combination's rate owes to the chance of its runs; what a seed does to all combinations is none of it."""
    rates = np.divide(sums, counts, out=np.full(sums.shape, np.nan), where=counts > 0)
    own = rates - np.nanmean(rates, axis=1, keepdims=True)
    enough = (counts > 0).sum(axis=0) > 1
    if not enough.any():
        return math.nan
    return float(np.mean(np.nanvar(own[:, enough], axis=0, ddof=1) / (counts[:, enough] > 0).sum(axis=0)))


def variance_shares(
    cells: pd.DataFrame, sums: np.ndarray, counts: np.ndarray, names: Sequence[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Share of the variance of success between combinations that each parameter explains by itself, and its interval.

    Three arrays (parameters,), 0..1: of all seeds, and both ends of the bootstrap over seeds. NaN where combinations differ
    no more than chance makes them differ, or from too few seeds.
    """
    noise, nothing = chance(sums, counts), np.full(len(names), np.nan)
    whole = _shares(cells, sums.sum(axis=0) / counts.sum(axis=0), names, noise)
    if len(sums) < FEWEST_SEEDS:
        return whole, nothing, nothing
    drawn = ratios(resampled(len(sums), DRAWS), sums, counts)
    known = drawn[np.isfinite(drawn).all(axis=1)]
    # A bootstrap sample has the chance of the runs in it once more.
    return (whole, *band(_shares(cells, known, names, 2 * noise))) if len(known) else (whole, nothing, nothing)


def _shares(cells: pd.DataFrame, rates: np.ndarray, names: Sequence[str], noise: float) -> np.ndarray:
    effects, total = sums_of_squares(cells, rates, names)
    degrees = np.array([cells[name].nunique() - 1 for name in names])
    signal = (total - (len(cells) - 1) * noise)[..., None]
    shares = np.divide(effects - degrees * noise, signal, out=np.full(effects.shape, np.nan), where=signal > 1e-9)
    return np.clip(shares, 0, 1)


def permutation_importances(cells: pd.DataFrame, sums: np.ndarray, counts: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """Loss of R² on held-out seeds when a parameter is shuffled, (splits, parameters); NaN from fewer than FEWEST_SEEDS.

    Each split trains on the rates of one half of the seeds and is judged on those of the other half.
    """
    from sklearn.inspection import permutation_importance  # noqa: PLC0415  # a second to load
    from sklearn.tree import DecisionTreeRegressor  # noqa: PLC0415

    if len(sums) < FEWEST_SEEDS:
        return np.full((1, len(names)), np.nan)
    random, lost, values = np.random.default_rng(_STREAM), [], cells[list(names)].to_numpy(float)
    for split in range(SPLITS):
        half = np.zeros(len(sums))
        half[random.permutation(len(sums))[: len(sums) // 2]] = 1
        seen, held_out = (ratios(weights[None], sums, counts)[0] for weights in (half, 1 - half))
        both = np.isfinite(seen) & np.isfinite(held_out)
        if both.sum() < 2 or np.ptp(held_out[both]) == 0:
            continue
        tree = DecisionTreeRegressor(min_samples_leaf=LEAF, random_state=split).fit(values[both], seen[both])
        found = permutation_importance(tree, values[both], held_out[both], scoring=_r_squared, n_repeats=2, random_state=split)
        lost.append(found.importances_mean)
    return np.array(lost) if lost else np.full((1, len(names)), np.nan)


def _r_squared(tree: Any, values: np.ndarray, rates: np.ndarray) -> float:
    # scikit-learn's own checks its arguments for ten times as long as it computes.
    return float(1 - ((rates - tree.predict(values)) ** 2).sum() / ((rates - rates.mean()) ** 2).sum())
