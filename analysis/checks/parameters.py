"""What one parameter does to success: gaps, best and worst values, trends."""

from __future__ import annotations

import numpy as np

from analysis.checks.bootstrap import ends, interval, mean_rates, whole_and_samples
from analysis.importance import by_value
from analysis.importance import largest_gap as widest_gap
from analysis.labels import TITLES, valued
from analysis.ranking import varied
from analysis.results import Results
from analysis.scatter import combinations
from analysis.selection import Selection
from analysis.verdicts import UNDECIDED, Checked, likely, near, within

NOT_YET = "not compared yet"


def largest_gap(store: Results, chosen: Selection, task: str, parameter: str, points: float) -> Checked:
    claim = f"largest gap between {TITLES[parameter]}s {points:g} points"
    return _gap(claim, widest_gap(store, chosen, task, parameter), parameter, points)


def gap_at_the_end(store: Results, chosen: Selection, task: str, parameter: str, points: float) -> Checked:
    claim = f"{points:g} points between {TITLES[parameter]}s at the last evaluation"
    return _gap(claim, widest_gap(store, chosen, task, parameter, at_last=True), parameter, points)


def most_influential(store: Results, chosen: Selection, task: str, parameter: str) -> Checked:
    names = varied(combinations(store, chosen)[0].query("task == @task"))
    gaps = {name: _gaps(store, chosen, task, name) for name in names}
    claim = f"{TITLES[parameter]} matters most"
    if parameter not in gaps or len(gaps) < 2 or gaps[parameter] is None:
        return Checked(claim, NOT_YET, UNDECIDED)
    others = np.max([gap for name, gap in gaps.items() if name != parameter], axis=0)
    share = float((gaps[parameter] > others).mean())
    return Checked(claim, f"widest gap of all in {share:.0%} of the bootstrap samples", likely(share))


def best_values(store: Results, chosen: Selection, task: str, parameter: str, values: list[float]) -> Checked:
    claim = f"best {TITLES[parameter]}: {' and '.join(valued(parameter, value) for value in values)}"
    whole, rates, known = mean_rates(store, chosen, task, parameter)
    if not set(values) <= set(known) or len(known) < 2:
        return Checked(claim, NOT_YET, UNDECIDED)
    order = np.argsort(whole)[::-1][: len(values)]
    ours = f"best {' and '.join(valued(parameter, known[place]) for place in order)} over all evaluations"
    if rates is None:
        return Checked(claim, ours, UNDECIDED)
    best = np.sort(np.argsort(rates, axis=1)[:, -len(values) :], axis=1)
    share = float((best == np.sort([known.index(value) for value in values])).all(axis=1).mean())
    return Checked(claim, f"{ours}; as in the dissertation in {share:.0%} of samples", likely(share))


def second_best(store: Results, chosen: Selection, task: str, parameter: str, value: float) -> Checked:
    return _in_place(store, chosen, task, parameter, value, -2, "second best")


def worst_value(store: Results, chosen: Selection, task: str, parameter: str, value: float) -> Checked:
    return _in_place(store, chosen, task, parameter, value, 0, "worst")


def values_alike(
    store: Results, chosen: Selection, task: str, parameter: str, values: list[float], points: float
) -> Checked:
    named = ", ".join(valued(parameter, value) for value in values)
    claim = f"{TITLES[parameter]}s {named} within {points:g} points of each other"
    whole, rates, known = mean_rates(store, chosen, task, parameter)
    if not set(values) <= set(known):
        return Checked(claim, NOT_YET, UNDECIDED)
    own = [known.index(value) for value in values]
    low, high = ends(None if rates is None else 100 * np.ptp(rates[:, own], axis=1))
    ours = f"{100 * np.ptp(whole[own]):.1f}{interval(low, high, '.1f')} points apart over all evaluations"
    return Checked(claim, ours, within(low, high, 0, points))


def no_trend(store: Results, chosen: Selection, task: str, parameter: str, points: float) -> Checked:
    claim = f"no trend by {TITLES[parameter]}: less than {points:g} points from the smallest to the largest"
    whole, rates, known = mean_rates(store, chosen, task, parameter)
    if len(known) < 3:
        return Checked(claim, NOT_YET, UNDECIDED)
    low, high = ends(None if rates is None else _rise(rates))
    ours = f"{_rise(whole):+.1f}{interval(low, high, '+.1f')} points, by a straight line through all values"
    return Checked(claim, ours, within(low, high, -points, points))


def larger_is_better(store: Results, chosen: Selection, task: str, parameter: str) -> Checked:
    claim = f"a larger {TITLES[parameter]} does better"
    whole, rates, known = mean_rates(store, chosen, task, parameter)
    if len(known) < 2:
        return Checked(claim, NOT_YET, UNDECIDED)
    ahead = None if rates is None else 100 * (rates[:, -1] - rates[:, 0])
    low, high = ends(ahead)
    compared = f"{valued(parameter, known[-1])} against {valued(parameter, known[0])}"
    gained = 100 * (whole[-1] - whole[0])
    ours = f"{compared}: {gained:+.1f}{interval(low, high, '+.1f')} points over all evaluations"
    return Checked(claim, ours, UNDECIDED if ahead is None else likely(float((ahead > 0).mean())))


def _rise(rates: np.ndarray) -> np.ndarray:
    """What a straight line through rates (..., values) in order gains from the first to the last, in points."""
    places = np.linspace(-0.5, 0.5, rates.shape[-1])
    return np.asarray(100 * (rates * places).sum(axis=-1) / (places**2).sum())


def _in_place(
    store: Results, chosen: Selection, task: str, parameter: str, value: float, place: int, word: str
) -> Checked:
    """Whether a value has this place in the order of success over all evaluations, from the worst (0)."""
    claim = f"{word} {TITLES[parameter]}: {valued(parameter, value)}"
    whole, rates, known = mean_rates(store, chosen, task, parameter)
    if value not in known or len(known) < 2:
        return Checked(claim, NOT_YET, UNDECIDED)
    ours = f"{word} {valued(parameter, known[int(np.argsort(whole)[place])])} over all evaluations"
    if rates is None:
        return Checked(claim, ours, UNDECIDED)
    share = float((np.argsort(rates, axis=1)[:, place] == known.index(value)).mean())
    return Checked(claim, f"{ours}; as in the dissertation in {share:.0%} of samples", likely(share))


def _gap(claim: str, gap: dict[str, float], parameter: str, points: float) -> Checked:
    if gap["best"] == gap["worst"]:
        return Checked(claim, f"only {valued(parameter, gap['best'])} so far", UNDECIDED)
    ours = f"{gap['points']:.1f}{interval(gap['low'], gap['high'], '.1f')} points at evaluation {gap['evaluation']:.0f}"
    return Checked(claim, ours, near(gap["low"], gap["high"], points))


def _gaps(store: Results, chosen: Selection, task: str, parameter: str) -> np.ndarray | None:
    """Widest gap of a parameter in each bootstrap sample."""
    sums, counts, _, _ = by_value(store, chosen, task, parameter)
    rates = whole_and_samples(sums, counts)[1]
    return None if rates is None else np.ptp(np.nan_to_num(rates), axis=1).max(axis=1)
