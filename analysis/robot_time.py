"""Success of approaches against what the robot's time is spent on, and how long the robot was needed until it lasted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from analysis.intervals import bootstrap, wilson

LASTING = 3
"""Evaluations in a row whose fittest controller succeeds: what counts as success that lasts."""
LATEST = 5
"""Evaluations over which curves of success are averaged: a controller's success changes from one to the next."""


def success_by_minute(evals: pd.DataFrame, minutes: Sequence[float] | np.ndarray) -> pd.DataFrame:
    """Share of runs whose latest evaluation by each minute of robot time was a success, with Wilson intervals.

    ``evals``: run_id, robot_s, success (or a share of successes), in the order of the evaluations. Columns minute, runs,
    successes, low, high. A run counts up to the robot time that it has used; before its first evaluation it has no success.
    """
    runs = [(own.robot_s.to_numpy() / 60, own.success.to_numpy(float)) for _, own in evals.groupby("run_id", sort=False)]
    rows = []
    for minute in minutes:
        within = [(spent, success) for spent, success in runs if minute <= spent[-1]]
        done = [success[: np.searchsorted(spent, minute, side="right")][-1:].sum() for spent, success in within]
        rows.append((float(minute), len(done), sum(done)))
    table = pd.DataFrame(rows, columns=["minute", "runs", "successes"])
    table = table[table.runs > 0]
    low, high = wilson(table.successes, table.runs)
    return table.assign(low=low, high=high)


def over_seeds(rows: pd.DataFrame, by_seed: Sequence[pd.DataFrame], at: str) -> pd.DataFrame:
    """The rows (column ``at``, runs, successes, low, high) with each interval at least as wide as that of a bootstrap over seeds.

    ``by_seed``: the same rows of each seed's runs alone. From fewer than `FEWEST_SEEDS` seeds they stay as they are.
    """
    sums, counts = (
        np.array([one.set_index(at)[name].reindex(rows[at], fill_value=0) for one in by_seed], float)
        for name in ("successes", "runs")
    )
    low, high = bootstrap(sums, counts)
    return rows.assign(low=np.fmin(rows.low, low), high=np.fmax(rows.high, high))


def of_latest(evals: pd.DataFrame, count: int = LATEST) -> pd.Series:
    """Share of successes among the latest ``count`` evaluations of the run at each evaluation (all of them, before that)."""
    rolled = evals.groupby("run_id", sort=False).success.rolling(count, min_periods=1).mean()
    return rolled.droplevel(0).reindex(evals.index)


def minutes_until_lasting(evals: pd.DataFrame, lasting: int = LASTING) -> pd.DataFrame:
    """Robot minutes of each run until the first of ``lasting`` successes in a row; ``ended`` False where there were none, and the
    minutes those of the whole run."""
    rows = []
    for run, own in evals.groupby("run_id", sort=False):
        success, minutes = own.success.to_numpy(bool), own.robot_s.to_numpy() / 60
        begins = [i for i in range(len(success) - lasting + 1) if success[i : i + lasting].all()]
        rows.append((run, minutes[begins[0]] if begins else minutes[-1], bool(begins)))
    return pd.DataFrame(rows, columns=["run_id", "minutes", "ended"])


def restricted_mean(
    minutes: Sequence[float] | np.ndarray, ended: Sequence[bool] | np.ndarray, horizon: float, weights: np.ndarray | None = None
) -> np.ndarray:
    """Mean of the smaller of ``horizon`` and the minutes until the end, where some runs stopped before it: the area below the
    curve of `survival` up to ``horizon`` (J. O. Irwin, 1949).

    ``weights`` (draws, runs): how often each run stands in each bootstrap sample; without them, once. Returns (draws,). Beyond
    the last run of a sample its curve stays where it is.
    """
    minutes, ended = np.asarray(minutes, float), np.asarray(ended, bool)
    weights = np.ones((1, len(minutes))) if weights is None else weights
    times = np.unique(minutes[ended & (minutes < horizon)])
    at_risk = weights @ (minutes[:, None] >= times).astype(float)
    ends = weights @ (ended[:, None] & (minutes[:, None] == times)).astype(float)
    left = np.divide(ends, at_risk, out=np.zeros_like(ends), where=at_risk > 0)
    share = np.cumprod(np.hstack([np.ones((len(weights), 1)), 1 - left]), axis=1)
    return np.asarray(share @ np.diff([0.0, *times, horizon]))


def survival(minutes: Sequence[float] | np.ndarray, ended: Sequence[bool] | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Kaplan and Meier's estimate (1958): times of ends, beginning with 0, and the share that goes on after each of them."""
    minutes, ended = np.asarray(minutes, float), np.asarray(ended, bool)
    times, share = [0.0], [1.0]
    for time in np.unique(minutes[ended]):
        at_risk = np.count_nonzero(minutes >= time)
        times.append(float(time))
        share.append(share[-1] * (1 - np.count_nonzero(ended & (minutes == time)) / at_risk))
    return np.array(times), np.array(share)
