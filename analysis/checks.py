"""One function a kind of finding: it measures these results as the dissertation measured its own, with an interval.

Each takes the store, a selection, a task and the arguments that stand in source.yaml, and gives a `Checked`.
"""

from __future__ import annotations

import math

import numpy as np

from analysis.diversity_of_extremes import curves
from analysis.importance import DRAWS, by_value
from analysis.importance import largest_gap as widest_gap
from analysis.intervals import FEWEST_SEEDS, band, ratios, resampled, wilson
from analysis.labels import TITLES, valued
from analysis.outcomes import by_seed
from analysis.potential_success import RADIUS_CM
from analysis.ranking import any_of, by_seed_array, extremes, ranking, varied
from analysis.results import Results
from analysis.scatter import combinations
from analysis.selection import Selection
from analysis.verdicts import UNDECIDED, Checked, likely, near, within

STEADY = 0.1
"""A diversity that changes by less than this share counts as steady."""


def largest_gap(store: Results, chosen: Selection, task: str, parameter: str, points: float) -> Checked:
    claim = f"largest gap between {TITLES[parameter]}s {points:g} points"
    return _gap(claim, widest_gap(store, chosen, task, parameter), parameter, points)


def gap_at_the_end(store: Results, chosen: Selection, task: str, parameter: str, points: float) -> Checked:
    claim = f"{points:g} points between {TITLES[parameter]}s at the last evaluation"
    return _gap(claim, widest_gap(store, chosen, task, parameter, at_last=True), parameter, points)


def saturates(store: Results, chosen: Selection, task: str, range: list[float]) -> Checked:
    sums, counts, _ = _over_evaluations(store, chosen, task)
    low, high = (100 * end for end in _bootstrapped(sums[:, -1], counts[:, -1]))
    ours = f"{100 * sums[:, -1].sum() / counts[:, -1].sum():.0f}{_interval(low, high, '.0f')} % at the last evaluation"
    return Checked(f"success saturates at {range[0]:g} to {range[1]:g} %", ours, within(low, high, *range))


def grows_evenly(store: Results, chosen: Selection, task: str, since: int) -> Checked:
    claim = f"success grows linearly from evaluation {since} on"
    sums, counts, evaluations = _over_evaluations(store, chosen, task)
    marks = np.array([since, (since + evaluations[-1]) / 2, evaluations[-1]])
    ends = np.abs(np.array(evaluations)[:, None] - marks).argmin(axis=0)
    share = _late_share(ratios(np.ones((1, len(sums))), sums, counts)[:, ends])[0]
    low = high = math.nan
    if len(sums) >= FEWEST_SEEDS:
        low, high = map(float, band(_late_share(ratios(resampled(len(sums), DRAWS), sums, counts)[:, ends])))
    ours = f"{share:.0f}{_interval(low, high, '.0f')} % of what it gains until the last falls into the second half"
    return Checked(claim, ours, near(low, high, 50))


def goes_with(store: Results, chosen: Selection, task: str, parameter: str, measure: str, direction: str) -> Checked:
    from scipy.stats import spearmanr  # noqa: PLC0415  # slow to load

    rows = combinations(store, chosen)[0].query("task == @task").dropna(subset=[measure])
    claim = f"{measure.replace('_', ' ')} {direction} with the {TITLES[parameter]}"
    if rows[parameter].nunique() < 2 or rows[measure].nunique() < 2:
        return Checked(claim, "not compared yet", UNDECIDED)
    sided = {"grows": "greater", "falls": "less"}[direction]
    found = spearmanr(rows[parameter], rows[measure], alternative=sided)
    ours = f"rank correlation {found.statistic:+.2f} ({len(rows)} combinations)"
    return Checked(claim, ours, likely(1 - float(found.pvalue)))


def most_influential(store: Results, chosen: Selection, task: str, parameter: str) -> Checked:
    names = varied(combinations(store, chosen)[0].query("task == @task"))
    gaps = {name: _gaps(store, chosen, task, name) for name in names}
    claim = f"{TITLES[parameter]} matters most"
    if parameter not in gaps or len(gaps) < 2 or gaps[parameter] is None:
        return Checked(claim, "not compared yet", UNDECIDED)
    others = np.max([gap for name, gap in gaps.items() if name != parameter], axis=0)
    share = float((gaps[parameter] > others).mean())
    return Checked(claim, f"widest gap of all in {share:.0%} of the bootstrap samples", likely(share))


def best_values(store: Results, chosen: Selection, task: str, parameter: str, values: list[float]) -> Checked:
    claim = f"best {TITLES[parameter]}: {' and '.join(valued(parameter, value) for value in values)}"
    rates, known = _mean_rates(store, chosen, task, parameter)
    if rates is None or not set(values) <= set(known):
        return Checked(claim, "not compared yet", UNDECIDED)
    best = np.sort(np.argsort(rates, axis=1)[:, -len(values) :], axis=1)
    share = float((best == np.sort([known.index(value) for value in values])).all(axis=1).mean())
    order = np.argsort(rates.mean(axis=0))[::-1][: len(values)]
    ours = " and ".join(valued(parameter, known[place]) for place in order)
    return Checked(claim, f"best {ours} over all evaluations; as in the dissertation in {share:.0%} of samples", likely(share))


def larger_is_better(store: Results, chosen: Selection, task: str, parameter: str) -> Checked:
    claim = f"a larger {TITLES[parameter]} does better"
    rates, known = _mean_rates(store, chosen, task, parameter)
    if rates is None or len(known) < 2:
        return Checked(claim, "not compared yet", UNDECIDED)
    ahead = 100 * (rates[:, -1] - rates[:, 0])
    low, high = band(ahead)
    ends = f"{valued(parameter, known[-1])} against {valued(parameter, known[0])}"
    ours = f"{ends}: {ahead.mean():+.1f}{_interval(low, high, '+.1f')} points over all evaluations"
    return Checked(claim, ours, likely(float((ahead > 0).mean())))


def best_combination(store: Results, chosen: Selection, task: str, column: str, percent: float) -> Checked:
    radius = f" within {column.removeprefix('success_')[:-2]} cm" if column != "success" else ""
    rows = combinations(store, chosen)[0].query("task == @task")
    best = rows.loc[(rows[column] / rows.runs).idxmax()]
    low, high = (100 * float(end) for end in wilson(best[column], best.runs))
    ours = f"{100 * best[column] / best.runs:.0f}{_interval(low, high, '.0f')} % of {best.runs:.0f} runs, as swept"
    return Checked(f"best combination {percent:g} %{radius}", ours, near(low, high, percent))


def diversity_range(store: Results, chosen: Selection, task: str, range: list[float]) -> Checked:
    last = curves(store, chosen, task, 0).query("evaluation == evaluation.max()")
    sums, counts = (by_seed_array(last, name)[0][:, 0] for name in ("diversity", "diversities"))
    low, high = _bootstrapped(sums, counts)
    mean = ratios(np.ones((1, len(sums))), sums, counts)[0]
    ours = f"mean of the best {mean:.2f}{_interval(low, high, '.2f')} at the last evaluation"
    return Checked(f"good diversity {range[0]:g} to {range[1]:g}", ours, within(low, high, *range))


def error_rises(store: Results, chosen: Selection, task: str) -> Checked:
    from scipy.stats import spearmanr  # noqa: PLC0415  # slow to load

    rows = combinations(store, chosen)[0].query("task == @task").dropna(subset=["diversity", "fitness_error"])
    upper = rows[rows.diversity > rows.diversity.median()]
    claim = "fitness error rises beyond some diversity"
    if len(upper) < 4 or upper.fitness_error.nunique() < 2:
        return Checked(claim, "too few combinations", UNDECIDED)
    found = spearmanr(upper.diversity, upper.fitness_error, alternative="greater")
    ours = f"rank correlation {found.statistic:+.2f} in the upper half ({len(upper)} combinations)"
    return Checked(claim, ours, likely(1 - float(found.pvalue)))


def best_have_at_most(store: Results, chosen: Selection, task: str, parameter: str, value: float) -> Checked:
    cells = extremes(ranking(store, chosen), task)[0]
    return _mostly(f"most of the best have {TITLES[parameter]} {valued(parameter, value)} or less", cells[parameter] <= value)


def worst_have_at_least(store: Results, chosen: Selection, task: str, parameter: str, value: float) -> Checked:
    cells = extremes(ranking(store, chosen), task)[1]
    return _mostly(f"most of the worst have {TITLES[parameter]} {valued(parameter, value)} or more", cells[parameter] >= value)


def diversity_of_best_is_steady(store: Results, chosen: Selection, task: str, since: int) -> Checked:
    change, low, high = _change(store, chosen, task, which=0, since=since)
    ours = f"changes by {100 * change:+.0f}{_interval(100 * low, 100 * high, '+.0f')} % from evaluation {since} to the last"
    return Checked(f"diversity of the best steady after evaluation {since}", ours, within(low, high, -STEADY, STEADY))


def diversity_of_best_moves(store: Results, chosen: Selection, task: str, direction: str, since: int) -> Checked:
    change, low, high = _change(store, chosen, task, which=0, since=since)
    ours = f"changes by {100 * change:+.0f}{_interval(100 * low, 100 * high, '+.0f')} % from evaluation {since} to the last"
    expected = {"grows": (0, math.inf), "falls": (-math.inf, 0)}[direction]
    return Checked(f"diversity of the best {direction} from evaluation {since} on", ours, within(low, high, *expected))


def diversity_of_worst_grows(store: Results, chosen: Selection, task: str) -> Checked:
    change, low, high = _change(store, chosen, task, which=1, since=5)
    ours = f"changes by {100 * change:+.0f}{_interval(100 * low, 100 * high, '+.0f')} % from evaluation 5 to the last"
    return Checked("diversity of the worst grows", ours, within(low, high, 0, math.inf))


def half_by(store: Results, chosen: Selection, task: str, evaluation: int) -> Checked:
    cells = extremes(ranking(store, chosen), task)[0]
    rows = by_seed(store, chosen, ("evaluation",), f"task = '{task}' AND ({any_of(cells)})")
    (sums, evaluations), (counts, _) = (by_seed_array(rows, name) for name in ("successes_20cm", "runs"))
    first, low, high = _first_half(ratios(np.ones((1, len(sums))), sums, counts), evaluations)[0], math.nan, math.nan
    if len(sums) >= FEWEST_SEEDS:
        drawn = _first_half(ratios(resampled(len(sums), DRAWS), sums, counts), evaluations)
        low, high = np.quantile(drawn, (0.025, 0.975), method="inverted_cdf")  # between a number and never lies nothing
    ours = f"by evaluation {first:g}{_interval(low, high, 'g')}".replace("inf", "never")
    claim = f"half of the best within {RADIUS_CM} cm by evaluation {evaluation}"
    return Checked(claim, ours, near(low, high, evaluation))


def _first_half(shares: np.ndarray, evaluations: np.ndarray) -> np.ndarray:
    half = shares >= 0.5
    return np.where(half.any(axis=1), np.asarray(evaluations, float)[half.argmax(axis=1)], np.inf)


def _gap(claim: str, gap: dict[str, float], parameter: str, points: float) -> Checked:
    if gap["best"] == gap["worst"]:
        return Checked(claim, f"only {valued(parameter, gap['best'])} so far", UNDECIDED)
    ours = f"{gap['points']:.1f}{_interval(gap['low'], gap['high'], '.1f')} points at evaluation {gap['evaluation']:.0f}"
    return Checked(claim, ours, near(gap["low"], gap["high"], points))


def _gaps(store: Results, chosen: Selection, task: str, parameter: str) -> np.ndarray | None:
    """Widest gap of a parameter in each bootstrap sample."""
    sums, counts, _, _ = by_value(store, chosen, task, parameter)
    if len(sums) < FEWEST_SEEDS:
        return None
    rates = np.nan_to_num(ratios(resampled(len(sums), DRAWS), sums, counts))
    return np.ptp(rates, axis=1).max(axis=1)


def _mean_rates(store: Results, chosen: Selection, task: str, parameter: str) -> tuple[np.ndarray | None, list]:
    """Success of each value over all evaluations in each bootstrap sample (draws, values), and the values."""
    sums, counts, values, _ = by_value(store, chosen, task, parameter)
    if len(sums) < FEWEST_SEEDS:
        return None, values
    return np.nan_to_num(ratios(resampled(len(sums), DRAWS), sums.sum(axis=2), counts.sum(axis=2))), values


def _over_evaluations(store: Results, chosen: Selection, task: str) -> tuple[np.ndarray, np.ndarray, list]:
    """Successes and runs (seeds, evaluations) of all combinations together, and the evaluations."""
    rows = by_seed(store, chosen, ("evaluation",), f"task = '{task}'")
    (sums, evaluations), (counts, _) = (by_seed_array(rows, name) for name in ("successes", "runs"))
    return sums, counts, list(evaluations)


def _late_share(rates: np.ndarray) -> np.ndarray:
    """Of rates (..., 3) at a beginning, middle and end: how much of the gain, in per cent, comes after the middle."""
    gained = rates[..., 2] - rates[..., 0]
    return np.divide(100 * (rates[..., 2] - rates[..., 1]), gained, out=np.full(gained.shape, np.nan), where=gained > 0)


def _bootstrapped(sums: np.ndarray, counts: np.ndarray) -> tuple[float, float]:
    if len(sums) < FEWEST_SEEDS:
        return math.nan, math.nan
    low, high = band(ratios(resampled(len(sums), DRAWS), sums, counts))
    return float(low), float(high)


def _mostly(claim: str, holds: np.ndarray) -> Checked:
    low, high = (float(end) for end in wilson(holds.sum(), len(holds)))
    return Checked(claim, f"{holds.sum()} of {len(holds)}", within(low, high, 0.5, 1.0))


def _change(store: Results, chosen: Selection, task: str, which: int, since: int) -> tuple[float, float, float]:
    """Relative change of the mean diversity of the best (0) or worst (1) from an evaluation to the last, and its interval."""
    rows = curves(store, chosen, task, which)
    ends = rows[rows.evaluation.isin([min(since, rows.evaluation.max()), rows.evaluation.max()])]
    sums, counts = (by_seed_array(ends, name)[0] for name in ("diversity", "diversities"))
    means = ratios(np.ones((1, len(sums))), sums, counts)[0]
    low = high = math.nan
    if len(sums) >= FEWEST_SEEDS:
        drawn = ratios(resampled(len(sums), DRAWS), sums, counts)
        low, high = map(float, band(drawn[:, -1] / drawn[:, 0] - 1))
    return float(means[-1] / means[0] - 1), low, high


def _interval(low: float, high: float, form: str) -> str:
    return "" if math.isnan(low) or math.isnan(high) else f" ({low:{form}} to {high:{form}})"
