"""How success grows with the evaluations, and how far the best and the worst combinations get."""

from __future__ import annotations

import math

import numpy as np

from analysis.best_combinations import confirmed
from analysis.checks.bootstrap import bootstrapped, ends, interval, mostly, whole_and_samples
from analysis.intervals import Z, wilson
from analysis.labels import CELL, TITLES, task_number, task_title, valued
from analysis.outcomes import COMBINATIONS, RUNS, by_seed, ever_by_seed, lost_and_regained, radii_cm, within_by_seed
from analysis.potential_success import RADIUS_CM
from analysis.ranking import any_of, by_seed_array, extremes, ranking
from analysis.results import NoDataError, Results
from analysis.scatter import combinations
from analysis.selection import Selection
from analysis.verdicts import UNDECIDED, Checked, likely, near, within

HALF = 0.5
REGAINED = 0.05
"""Share of runs from which on "instances" of a convergence that is lost and regained are no exception."""


def saturates(store: Results, chosen: Selection, task: str, range: list[float]) -> Checked:
    sums, counts, _ = _over_evaluations(store, chosen, task)
    low, high = (100 * end for end in bootstrapped(sums[:, -1], counts[:, -1]))
    ours = f"{100 * sums[:, -1].sum() / counts[:, -1].sum():.0f}{interval(low, high, '.0f')} % at the last evaluation"
    return Checked(f"success saturates at {range[0]:g} to {range[1]:g} %", ours, within(low, high, *range))


def grows_evenly(store: Results, chosen: Selection, task: str, since: int) -> Checked:
    claim = f"success grows linearly from evaluation {since} on"
    sums, counts, evaluations = _over_evaluations(store, chosen, task)
    marks = np.array([since, (since + evaluations[-1]) / 2, evaluations[-1]])
    at = np.abs(np.array(evaluations)[:, None] - marks).argmin(axis=0)
    whole, samples = whole_and_samples(sums, counts)
    low, high = ends(None if samples is None else _late_share(samples[:, at]))
    late = f"{_late_share(whole[at]):.0f}{interval(low, high, '.0f')}"
    ours = f"{late} % of what it gains until the last falls into the second half"
    return Checked(claim, ours, near(low, high, 50))


def best_combination(store: Results, chosen: Selection, task: str, column: str, percent: float) -> Checked:
    """With as many combinations and runs of each as the dissertation has: as swept, which is lucky in both. With fewer: on fresh
    seeds, where the best were rerun."""
    radius = f" within {column.removeprefix('success_')[:-2]} cm" if column != "success" else ""
    claim = f"best combination {percent:g} %{radius}"
    rows = combinations(store, chosen)[0].query("task == @task")
    again = confirmed(store, chosen, task)
    if len(rows) >= COMBINATIONS and rows.runs.min() >= RUNS:
        return _best_as_swept(store, chosen, task, column, percent, claim)
    if len(again):
        successes, runs = again[_confirmed(column)], again.confirm_runs
        how, drawn_from = f"runs on fresh seeds, the best of {len(again)} that were rerun", int(runs.sum())
    else:
        successes, runs, how, drawn_from = rows[column], rows.runs, "runs, as swept", None
    best = (successes / runs).idxmax()
    low, high = (100 * float(end) for end in wilson(successes[best], runs[best]))
    ours = f"{100 * successes[best] / runs[best]:.0f}{interval(low, high, '.0f')} % of {runs[best]:.0f} {how}"
    return Checked(claim, ours, near(low, high, percent), drawn_from)


def _best_as_swept(store: Results, chosen: Selection, task: str, column: str, percent: float, claim: str) -> Checked:
    """The best share of a study of this size, with the standard deviation of that over bootstrap samples of the seeds.

    Their mean is no use here: in a sample of the sample, the best is luckier still.
    """
    rows = within_by_seed(store, chosen, CELL, f"task = '{task}' AND last", column)
    cells = rows[list(CELL)].apply(tuple, axis=1)
    (sums, names), (counts, _) = (by_seed_array(rows.assign(cell=cells), name, "cell") for name in ("within", "runs"))
    whole, samples = whole_and_samples(sums, counts)
    best, share = int(np.nanargmax(whole)), 100 * float(np.nanmax(whole))
    spread = math.nan if samples is None else 100 * Z * float(np.nanmax(samples, axis=1).std())
    low, high = max(share - spread, 0.0), min(share + spread, 100.0)
    ours = f"{share:.0f}{interval(low, high, '.0f')} % of {counts[:, best].sum():.0f} runs, the best of {len(names)} as swept"
    again = confirmed(store, chosen, task)
    same = again[again[list(CELL)].apply(tuple, axis=1) == names[best]] if len(again) else again
    if len(same):
        fresh, n = int(same[_confirmed(column)].iloc[0]), int(same.confirm_runs.iloc[0])
        ours += f"; the same combination on fresh seeds {100 * fresh / n:.0f} % of {n}"
    return Checked(claim, ours, near(low, high, percent))


def _confirmed(column: str) -> str:
    return "confirm_successes" if column == "success" else f"confirm_{column}"


def best_have_at_most(store: Results, chosen: Selection, task: str, parameter: str, value: float) -> Checked:
    cells = extremes(ranking(store, chosen), task)[0]
    return mostly(f"most of the best have {TITLES[parameter]} {valued(parameter, value)} or less", cells[parameter] <= value)


def worst_have_at_least(store: Results, chosen: Selection, task: str, parameter: str, value: float) -> Checked:
    cells = extremes(ranking(store, chosen), task)[1]
    return mostly(f"most of the worst have {TITLES[parameter]} {valued(parameter, value)} or more", cells[parameter] >= value)


def half_by(store: Results, chosen: Selection, task: str, evaluation: int) -> Checked:
    """Each of the best combinations by itself, and sooner is no difference (figure 4.16)."""
    cells = extremes(ranking(store, chosen), task)[0]
    claim = f"each of the best has half of its runs within {RADIUS_CM} cm by evaluation {evaluation}"
    where = f"task = '{task}' AND evaluation <= {evaluation} AND ({any_of(cells)})"
    rows = by_seed(store, chosen, ("evaluation", *CELL), where)
    curve = rows[["evaluation", *CELL]].apply(tuple, axis=1)
    rows = rows.assign(curve=curve)
    (sums, columns), (counts, _) = (by_seed_array(rows, name, "curve") for name in ("successes_20cm", "runs"))
    whole, samples = whole_and_samples(sums, counts)
    numbers = {cell: number for number, cell in enumerate(cells[list(CELL)].itertuples(index=False, name=None))}
    own = np.array([numbers[one[1:]] for one in columns])
    reached = [bool((whole[own == number] >= HALF).any()) for number in range(len(cells))]
    ours = f"{sum(reached)} of {len(cells)}"
    if samples is None:
        return Checked(claim, ours, UNDECIDED)
    always = np.all([(samples[:, own == number] >= HALF).any(axis=1) for number in range(len(cells))], axis=0)
    return Checked(claim, f"{ours}; all of them in {always.mean():.0%} of the bootstrap samples", likely(float(always.mean())))


def worst_never_succeed(store: Results, chosen: Selection, task: str) -> Checked:
    """At the widest radius, and so at all."""
    cells, near_cm = extremes(ranking(store, chosen), task)[1], radii_cm(store, chosen)
    column = f"success_{near_cm[-1]}cm" if near_cm else "success"
    rows = combinations(store, chosen)[0].merge(cells[["task", *CELL]], on=["task", *CELL])
    low, high = (100 * float(end) for end in wilson(rows[column].sum(), rows.runs.sum()))
    ours = f"{100 * rows[column].sum() / rows.runs.sum():.1f}{interval(low, high, '.1f')} % at the widest radius"
    return Checked("the worst combinations succeed at no radius", ours, near(low, high, 0))


def convergence_is_lost_and_regained(store: Results, chosen: Selection, task: str) -> Checked:
    """A fittest controller within 20 cm (or the task's own regions), then a miss, then success again, in one run."""
    regained, runs = lost_and_regained(store, chosen, task)
    low, high = (float(end) for end in wilson(regained, runs))
    ours = f"in {100 * regained / runs:.0f}{interval(100 * low, 100 * high, '.0f')} % of the runs"
    return Checked("success is lost and regained in some runs", ours, within(low, high, REGAINED, 1.0))


def needs_more_than(store: Results, chosen: Selection, task: str, times: float, of: int) -> Checked:
    """Evaluations until half of the runs have ever succeeded, against those of another task of the robot."""
    named = {task_number(chosen.robot, one): one for one in chosen.tasks}
    if of not in named:
        raise NoDataError(f"there are no runs of task {of} to compare with")
    claim = f"more than {times:g} times the evaluations of {task_title(chosen.robot, named[of])} until half of the runs succeeded"
    here, there = (_until_half(store, chosen, one) for one in (task, named[of]))
    if here is None or there is None:
        return Checked(claim, "fewer than half of the runs ever succeeded", UNDECIDED)
    (whole, samples), (other, others) = here, there
    low, high = ends(None if samples is None or others is None else samples / others)
    return Checked(claim, f"{whole / other:.1f}{interval(low, high, '.1f')} times", within(low, high, times, math.inf))


def _until_half(store: Results, chosen: Selection, task: str) -> tuple[float, np.ndarray | None] | None:
    rows = ever_by_seed(store, chosen, task)
    (sums, evaluations), (counts, _) = (by_seed_array(rows, name) for name in ("successes", "runs"))
    whole, samples = whole_and_samples(sums, counts)
    first = _first_half(whole[None], evaluations)[0]
    if not math.isfinite(first):
        return None
    return float(first), None if samples is None else np.minimum(_first_half(samples, evaluations), evaluations[-1] + 1)


def _first_half(shares: np.ndarray, evaluations: np.ndarray) -> np.ndarray:
    """First evaluation at which shares (draws, evaluations) reach a half; infinite where they never do."""
    half = shares >= HALF
    return np.where(half.any(axis=1), np.asarray(evaluations, float)[half.argmax(axis=1)], np.inf)


def _over_evaluations(store: Results, chosen: Selection, task: str) -> tuple[np.ndarray, np.ndarray, list]:
    """Successes and runs (seeds, evaluations) of all combinations together, and the evaluations."""
    rows = by_seed(store, chosen, ("evaluation",), f"task = '{task}'")
    (sums, evaluations), (counts, _) = (by_seed_array(rows, name) for name in ("successes", "runs"))
    return sums, counts, list(evaluations)


def _late_share(rates: np.ndarray) -> np.ndarray:
    """Of rates (..., 3) at a beginning, middle and end: how much of the gain, in per cent, comes after the middle."""
    gained = rates[..., 2] - rates[..., 0]
    return np.divide(100 * (rates[..., 2] - rates[..., 1]), gained, out=np.full(gained.shape, np.nan), where=gained > 0)
