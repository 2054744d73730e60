"""Combinations of parameters from best to worst, as section 4.5 of the dissertation ranks them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from analysis.labels import CELL, SHORT, valued
from analysis.outcomes import NEAR
from analysis.results import NoDataError, Results, remembered
from analysis.scatter import combinations
from analysis.selection import Selection
from bns.sweep.confirm import RANKED_BY

TEN = 10


@remembered
def ranking(store: Results, chosen: Selection) -> pd.DataFrame:
    """Combinations with enough runs at their last evaluation, task by task from best to worst; ``rank`` counts from 1.

    Success by the task's own criterion decides, then at wider goal radii, then mean fitness of the fittest in the world.

    Raises:
        NoDataError: no combination has enough runs yet.
    """
    rows, _ = combinations(store, chosen)
    shares = rows.assign(**{name: rows[name] / rows.runs for name in ("success", *NEAR)}, successes=rows.success)
    ordered = shares.sort_values([*RANKED_BY, *CELL], ascending=[False] * len(RANKED_BY) + [True] * len(CELL))
    ordered = ordered.assign(rank=ordered.groupby("task").cumcount() + 1)
    places = {task: number for number, task in enumerate(chosen.tasks)}
    return ordered.sort_values(["task", "rank"], key=lambda column: column.map(places) if column.name == "task" else column)


def extremes(rows: pd.DataFrame, task: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The ten best and the ten worst combinations of a task; half of them each if there are fewer than twenty.

    Raises:
        NoDataError: there is only one combination.
    """
    own = rows[rows.task == task]
    many = min(TEN, len(own) // 2)
    if not many:
        raise NoDataError(
            f"task {task} has one combination with enough runs; best and worst need two: run bns sweep khepera-small"
        )
    return own.head(many), own.tail(many)


def any_of(cells: pd.DataFrame) -> str:
    """SQL: a row belongs to one of these combinations."""
    return " OR ".join(
        "(" + " AND ".join(f"{name} = {getattr(row, name)!r}" for name in CELL) + ")"
        for row in cells[list(CELL)].astype(float).itertuples()
    )


def varied(rows: pd.DataFrame) -> list[str]:
    """Those of the four parameters that take more than one value."""
    return [name for name in CELL if rows[name].nunique() > 1]


def in_words(row: object, names: Sequence[str] = CELL) -> str:
    """A combination as it stands on a figure; by default all four parameters."""
    return ", ".join(f"{SHORT[name]} {valued(name, getattr(row, name))}" for name in names or CELL)


def by_seed_array(rows: pd.DataFrame, value: str, column: str = "evaluation") -> tuple[np.ndarray, pd.Index]:
    """Sum of ``value`` in an array (seeds, columns), and what the columns stand for; 0 where there is nothing."""
    table = rows.pivot_table(index=["root_seed", "seed"], columns=column, values=value, aggfunc="sum", fill_value=0)
    return table.to_numpy(float), table.columns
