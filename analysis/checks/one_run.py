"""What figure 4.17 shows of single runs: of all that recorded their generations and probes."""

from __future__ import annotations

import numpy as np
import pandas as pd

from analysis.checks.bootstrap import interval
from analysis.intervals import wilson
from analysis.results import NoDataError, Results, among
from analysis.selection import RUNS, Selection
from analysis.verdicts import Checked, within

NOT_RECORDED = "no stored run of the study's settings has generations and probes; run bns sweep prototype"
_FEWEST = 6
"""Evaluations that a run must have for thirds of it to be compared."""


def world_is_mostly_below(store: Results, chosen: Selection, task: str) -> Checked:
    rows = _asked(
        store,
        f"""
        SELECT avg((best_fitness_world < best_fitness)::INT) > 0.5 AS holds FROM generations
        JOIN ({_recorded(chosen, task)}) AS recorded USING (run_id, sweep) GROUP BY run_id""",
    )
    return _in_most_runs("fitness in the world mostly below that in simulation", rows.holds.to_numpy(bool))


def probes_settle(store: Results, chosen: Selection, task: str) -> Checked:
    return _in_most_runs("distance of simulator and world settles", _smaller_at_the_end(store, chosen, task, "distance_m"))


def simulators_change_less(store: Results, chosen: Selection, task: str) -> Checked:
    return _in_most_runs("changes between simulators shrink", _smaller_at_the_end(store, chosen, task, "change_m"))


def _asked(store: Results, sql: str) -> pd.DataFrame:
    """Rows of generations or probes; none from an archive of runs that recorded neither."""
    try:
        return store.query(sql)
    except NoDataError:
        raise NoDataError(NOT_RECORDED) from None


def _recorded(chosen: Selection, task: str) -> str:
    """SELECT of finished runs of the task at the study's settings (its world, say), of any sweep that recorded them."""
    return (
        f"SELECT run_id, min(sweep) AS sweep FROM {RUNS} WHERE status = 'ok' AND ({chosen.setting}) "
        f"AND {among('task', [task])} GROUP BY run_id"
    )


def _smaller_at_the_end(store: Results, chosen: Selection, task: str, column: str) -> np.ndarray:
    """Of each run, whether median and spread of the last third of its evaluations lie below those of the first third."""
    rows = _asked(
        store,
        f"""
        SELECT run_id, evaluation, median({column}) AS value FROM probes
        JOIN ({_recorded(chosen, task)}) AS recorded USING (run_id, sweep)
        WHERE {column} IS NOT NULL AND isfinite({column}) GROUP BY ALL ORDER BY ALL""",
    )
    holds = []
    for _, one in rows.groupby("run_id"):
        third = len(one) // 3
        if len(one) >= _FEWEST:
            first, last = one.value.to_numpy()[:third], one.value.to_numpy()[-third:]
            holds.append(bool(np.median(last) < np.median(first) and np.ptp(last) < np.ptp(first)))
    return np.array(holds, bool)


def _in_most_runs(claim: str, holds: np.ndarray) -> Checked:
    if not len(holds):
        raise NoDataError(NOT_RECORDED)
    low, high = (float(end) for end in wilson(holds.sum(), len(holds)))
    ours = f"in {holds.sum()} of {len(holds)} runs{interval(100 * low, 100 * high, '.0f')}"
    return Checked(claim, ours, within(low, high, 0.5, 1.0), len(holds))
