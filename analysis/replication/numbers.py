"""What a study has of each robot's tasks, and its findings with their verdicts."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import pandas as pd

from analysis.findings import checked
from analysis.labels import CELL, task_number, task_title
from analysis.outcomes import last_outcomes
from analysis.results import Results
from analysis.selection import Selection, selections
from analysis.verdicts import AGREES, DIFFERS, UNDECIDED

VERDICTS = {AGREES: "replicates", DIFFERS: "differs", UNDECIDED: "undecided"}
"""Of a check -> on the page."""


@dataclass(frozen=True)
class Study:
    """The runs of one robot that are counted together, its tasks and its findings."""

    chosen: Selection
    tasks: pd.DataFrame
    """A row a task: task, runs, combinations, seeds, and runs of a combination (least, most)."""
    findings: pd.DataFrame
    """A row a finding and task: task, where, "the dissertation", "these results", verdict (of `VERDICTS`)."""

    @property
    def counts(self) -> pd.DataFrame:
        """How many findings have which verdict, a row a task."""
        rows = [Counter(own.verdict) for _, own in self.findings.groupby("task", sort=True)]
        titles = sorted(set(self.findings.task))
        return pd.DataFrame([{"task": title, **{word: row[word] for word in VERDICTS.values()}}
                             for title, row in zip(titles, rows, strict=True)])  # fmt: skip


def studies(store: Results) -> list[Study]:
    """One a robot that the dissertation has findings of; NoDataError if no sweep compares parameters."""
    found = [Study(chosen, _tasks(store, chosen), checked(store, chosen, early=True)) for chosen in selections(store)]
    return [
        Study(one.chosen, one.tasks, one.findings.assign(verdict=one.findings.verdict.map(VERDICTS)))
        for one in found
        if not one.findings.empty
    ]


def by_either_reading(now: Study, so_far: Study) -> pd.DataFrame:
    """Findings that depend on whose success is meant: task, where, "the dissertation", then numbers and verdicts of either.

    so_far: the same runs seen with `Results(so_far=True)`. That success is lost again can only be said of success now.
    """
    keys = ["task", "where", "the dissertation"]
    both = now.findings.merge(so_far.findings, on=keys, suffixes=("", " so far"), validate="one_to_one")
    differ = (both["these results"] != both["these results so far"]) & ~both["the dissertation"].str.contains("lost and regained")
    return both[differ].reset_index(drop=True)


def _tasks(store: Results, chosen: Selection) -> pd.DataFrame:
    cells = ", ".join(CELL)
    rows = store.query(f"""
        WITH cells AS (SELECT task, {cells}, count(*) AS runs FROM {last_outcomes(store, chosen)} GROUP BY ALL),
             seeds AS (SELECT task, count(DISTINCT (root_seed, seed)) AS seeds FROM {last_outcomes(store, chosen)} GROUP BY task)
        SELECT task, sum(runs)::BIGINT AS runs, count(*) AS combinations, any_value(seeds) AS seeds,
               min(runs) AS least, max(runs) AS most
        FROM cells JOIN seeds USING (task) GROUP BY task""")
    order = {task: place for place, task in enumerate(chosen.tasks)}
    rows = rows.sort_values("task", key=lambda column: column.map(order))
    titles = [f"{task_number(chosen.robot, task)}, {task_title(chosen.robot, task)}" for task in rows.task]
    return rows.assign(task=titles).reset_index(drop=True)
