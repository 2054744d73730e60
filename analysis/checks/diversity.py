"""Diversity: of the best and the worst combinations over time, and beside success and error."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from analysis.checks.bootstrap import bootstrapped, ends, interval, whole_and_samples
from analysis.diversity_of_extremes import FIRST_EVALUATION, curves
from analysis.intervals import rank_correlation
from analysis.labels import CELL, TITLES
from analysis.ranking import by_seed_array
from analysis.results import Results
from analysis.scatter import combinations
from analysis.selection import Selection
from analysis.verdicts import UNDECIDED, Checked, likely, near, within

STEADY = 0.1
"""A diversity that changes by less than this share counts as steady."""
MAXIMUM = (0.8, 1.2)
"""The worst end near the largest diversity of all combinations: their mean over it lies in this range."""
BESIDE = 2
"""Combinations of ten by which a count may differ from the dissertation's."""
RELATED = 0.1
"""The least rank correlation that counts as "grows" or "falls": below it an effect is not even small (J. Cohen, Statistical Power
Analysis for the Behavioral Sciences, 2nd ed., 1988, section 3.2). Without such a bound, no relation at all is never decided."""
_DRAWS, _STREAM = 1000, 11


def diversity_range(store: Results, chosen: Selection, task: str, range: list[float]) -> Checked:
    last = curves(store, chosen, task, 0).query("evaluation == evaluation.max()")
    sums, counts = (by_seed_array(last, name)[0][:, 0] for name in ("diversity", "diversities"))
    low, high = bootstrapped(sums, counts)
    ours = f"mean of the best {sums.sum() / counts.sum():.2f}{interval(low, high, '.2f')} at the last evaluation"
    return Checked(f"good diversity {range[0]:g} to {range[1]:g}", ours, within(low, high, *range))


def best_in_range(store: Results, chosen: Selection, task: str, range: list[float], count: int) -> Checked:
    claim = f"{count} of the ten best within the good diversity, {range[0]:g} to {range[1]:g}"
    whole, samples = _of_each(store, chosen, task, which=0)
    low, high = ends(None if samples is None else _inside(samples, range))
    ours = f"{_inside(whole, range):.0f}{interval(low, high, '.0f')} of {whole.shape[-1]} at the last evaluation"
    return Checked(claim, ours, near(low, high, count, BESIDE))


def best_have_a_range(store: Results, chosen: Selection, task: str, than_worst: str) -> Checked:
    """``than_worst``: wider or narrower, of the diversities of either ten at the last evaluation."""
    claim = f"diversities of the best span a {than_worst} range than those of the worst"
    (best, bests), (worst, worsts) = (_of_each(store, chosen, task, which) for which in (0, 1))
    ours = f"{np.ptp(best):.2f} against {np.ptp(worst):.2f}"
    if bests is None or worsts is None:
        return Checked(claim, ours, UNDECIDED)
    wider = float((np.ptp(bests, axis=1) > np.ptp(worsts, axis=1)).mean())
    return Checked(claim, f"{ours}; wider in {wider:.0%} of the samples", likely(wider if than_worst == "wider" else 1 - wider))


def diversity_of_best_is_steady(store: Results, chosen: Selection, task: str, since: int) -> Checked:
    return _moves(store, chosen, task, 0, since, f"diversity of the best steady after evaluation {since}", (-STEADY, STEADY))


def diversity_of_best_moves(store: Results, chosen: Selection, task: str, direction: str, since: int) -> Checked:
    expected = {"grows": (0, math.inf), "falls": (-math.inf, 0)}[direction]
    return _moves(store, chosen, task, 0, since, f"diversity of the best {direction} from evaluation {since} on", expected)


def diversity_of_worst_grows(store: Results, chosen: Selection, task: str) -> Checked:
    return _moves(store, chosen, task, 1, FIRST_EVALUATION, "diversity of the worst grows", (0, math.inf))


def diversity_of_worst_goes_nowhere(store: Results, chosen: Selection, task: str) -> Checked:
    claim = "diversity of the worst neither grows nor falls steadily"
    return _moves(store, chosen, task, 1, FIRST_EVALUATION, claim, (-STEADY, STEADY))


def diversity_of_worst_saturates(store: Results, chosen: Selection, task: str) -> Checked:
    """Near the largest diversity of all combinations at the last evaluation, which is how the dissertation confirms it."""
    whole, samples = _of_each(store, chosen, task, which=1)
    largest = combinations(store, chosen)[0].query("task == @task").diversity.max()
    low, high = ends(None if samples is None else samples.mean(axis=1) / largest)
    ours = f"{100 * whole.mean() / largest:.0f}{interval(100 * low, 100 * high, '.0f')} % of the largest of all combinations"
    return Checked("diversity of the worst ends near the largest there is", ours, within(low, high, *MAXIMUM))


def error_rises(store: Results, chosen: Selection, task: str) -> Checked:
    rows = combinations(store, chosen)[0].query("task == @task").dropna(subset=["diversity", "fitness_error"])
    upper = rows[rows.diversity > rows.diversity.median()]
    claim = "fitness error rises beyond some diversity"
    if len(upper) < 4 or upper.fitness_error.nunique() < 2:
        return Checked(claim, "too few combinations", UNDECIDED)
    ours, verdict = _related(upper.diversity, upper.fitness_error, "grows")
    return Checked(claim, f"{ours} in the upper half ({len(upper)} combinations)", verdict)


def low_diversity_spreads(store: Results, chosen: Selection, task: str, measure: str) -> Checked:
    """Standard deviation between combinations in the lowest quarter of diversity, against the quarter above it."""
    claim = f"a wider range of {measure.replace('_', ' ')} at low diversity"
    rows = combinations(store, chosen)[0].query("task == @task").dropna(subset=["diversity", "fitness_error"])
    rows = rows.assign(success=rows.success / rows.runs).sort_values("diversity")
    quarter = len(rows) // 4
    if quarter < 4:
        return Checked(claim, "too few combinations", UNDECIDED)
    lowest, next_up = (rows[measure].to_numpy()[part] for part in (slice(quarter), slice(quarter, 2 * quarter)))
    random = np.random.default_rng(_STREAM)
    low, high = (random.choice(part, (_DRAWS, quarter)).std(axis=1) for part in (lowest, next_up))
    ours = f"standard deviation {lowest.std():.3f} in the lowest quarter, {next_up.std():.3f} in the next"
    return Checked(claim, ours, likely(float((low > high).mean())))


def goes_with(store: Results, chosen: Selection, task: str, parameter: str, measure: str, direction: str) -> Checked:
    rows = combinations(store, chosen)[0].query("task == @task").dropna(subset=[measure])
    claim = f"{measure.replace('_', ' ')} {direction} with the {TITLES[parameter]}"
    if rows[parameter].nunique() < 2 or rows[measure].nunique() < 2:
        return Checked(claim, "not compared yet", UNDECIDED)
    ours, verdict = _related(rows[parameter], rows[measure], direction)
    return Checked(claim, f"{ours} ({len(rows)} combinations)", verdict)


def _related(first: pd.Series, second: pd.Series, direction: str) -> tuple[str, str]:
    """Rank correlation with its interval, in words, and whether it is at least `RELATED` in this direction."""
    found, low, high = rank_correlation(first, second)
    expected = {"grows": (RELATED, 1.0), "falls": (-1.0, -RELATED)}[direction]
    return f"rank correlation {found:+.2f}{interval(low, high, '+.2f')}", within(low, high, *expected)


def _inside(values: np.ndarray, range: list[float]) -> np.ndarray:
    return np.asarray(((values >= range[0]) & (values <= range[1])).sum(axis=-1), float)


def _of_each(store: Results, chosen: Selection, task: str, which: int) -> tuple[np.ndarray, np.ndarray | None]:
    """Diversity of each of the best (0) or worst (1) at the last evaluation: (combinations,), and (draws, combinations)."""
    rows = curves(store, chosen, task, which).query("evaluation == evaluation.max()")
    rows = rows.assign(cell=pd.factorize(rows[list(CELL)].apply(tuple, axis=1))[0])
    sums, counts = (by_seed_array(rows, name, "cell")[0] for name in ("diversity", "diversities"))
    return whole_and_samples(sums, counts)


def _moves(
    store: Results, chosen: Selection, task: str, which: int, since: int, claim: str, expected: tuple[float, float]
) -> Checked:
    """Relative change of the mean diversity of the best (0) or worst (1) from an evaluation to the last."""
    rows = curves(store, chosen, task, which)
    last = rows.evaluation.max()
    if last <= since:
        return Checked(claim, f"too few evaluations: {last}, and it is about what changes from evaluation {since} on", UNDECIDED)
    at = rows[rows.evaluation.isin([since, last])]
    sums, counts = (by_seed_array(at, name)[0] for name in ("diversity", "diversities"))
    means, samples = whole_and_samples(sums, counts)
    low, high = ends(None if samples is None else samples[:, -1] / samples[:, 0] - 1)
    change = means[-1] / means[0] - 1
    ours = f"changes by {100 * change:+.0f}{interval(100 * low, 100 * high, '+.0f')} % from evaluation {since} to the last"
    return Checked(claim, ours, within(low, high, *expected))
