"""What the figures share: questions to the store, which runs may stand in one curve, intervals, captions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import duckdb
import pandas as pd
from matplotlib.figure import Figure

from bns import store as results_store
from bns.errors import BnsError, SpecError, StoreError
from bns.spec import FIELDS
from bns.store.schema import PARAMETERS
from bns.sweep.grid import parse_sweep
from bns.tasks import load_task

BEGIN = "make sweep-khepera BUDGET=10m"
SETTING = (
    *("robot", "world", "world_digest", "training_algorithm", "evaluations", "min_commands", "max_commands"),
    *("generations_per_evaluation", "training_iterations_per_evaluation"),
)
"""Columns of runs that must agree before runs are counted together."""


class NoDataError(BnsError):
    """The store has nothing for a figure; the message says what would feed it."""


@dataclass(frozen=True)
class Drawn:
    """A figure and what its caption says: ``n`` runs stand in it, ``missing`` names what does not."""

    name: str
    figure: Figure
    shows: str
    n: int
    sweeps: tuple[str, ...]
    missing: tuple[str, ...] = ()


@dataclass(frozen=True)
class Plan:
    """What the newest file of a sweep asks for; ``cells`` and ``mutation_rates`` are empty if it cannot be read."""

    runs: int
    cells: int
    mutation_rates: frozenset[float]


class Store:
    """The results in one folder as they are now: all figures of one call show the same runs.

    Raises:
        StoreError: there is no run at all; the message says what to run.
    """

    def __init__(self, results: Path | str) -> None:
        self.results = Path(results)
        written = any((self.results / name).is_dir() for name in ("runs", "journal"))
        if not written or not self.query("SELECT count(*) AS n FROM runs").n[0]:
            raise StoreError(
                f"there are no runs in {self.results} to draw. Make some with: {BEGIN}; or name "
                "another folder with --results DIR."
            )

    def query(self, sql: str) -> pd.DataFrame:
        """Rows of a SELECT over the tables of the store."""
        try:
            return self._connection.execute(sql).df()
        except duckdb.IOException:  # a compaction has replaced files meanwhile: the rows are the same in the new ones
            return results_store.query(self.results, sql)

    @cached_property
    def _connection(self) -> duckdb.DuckDBPyConnection:
        return results_store.connect(self.results)

    @cached_property
    def plans(self) -> dict[str, Plan]:
        """By sweep, what its newest file asks for; sweeps that were written without one are absent."""
        newest = self.query(
            "SELECT sweep, arg_max(text, written_at) AS text, arg_max(runs, written_at) AS runs "
            "FROM specs GROUP BY sweep ORDER BY sweep"
        )
        return {row.sweep: _plan(row.text, row.runs) for row in newest.itertuples()}


def _plan(text: str, runs: float) -> Plan:
    try:
        sweep = parse_sweep(text, Path("the stored sweep file"))
    except SpecError:  # written for another version of bns: its size is known all the same
        return Plan(0 if pd.isna(runs) else int(runs), 0, frozenset())
    default = FIELDS["mutation_rate"].default
    rates = frozenset(float(combo.get("mutation_rate", default)) for combo in sweep.combos)
    return Plan(sweep.total, len(sweep.combos), rates)


def among(column: str, values: Iterable[str]) -> str:
    """SQL: ``column`` is one of ``values``; of none, if there are none."""
    listed = ", ".join("'" + value.replace("'", "''") + "'" for value in values)
    return f"{column} IN ({listed})" if listed else "false"


@dataclass(frozen=True)
class Selection:
    """Runs that may be counted together: all finished ones of ``sweeps`` at one setting a task."""

    sweeps: tuple[str, ...]
    condition: str
    n: int
    tasks: tuple[tuple[str, str], ...]
    left_out: tuple[str, ...]

    @property
    def sql(self) -> str:
        """SELECT of run_id, sweep and number of evaluations. The same run in two sweeps counts once."""
        return (
            f"SELECT run_id, min(sweep) AS sweep, any_value(evaluations) AS evaluations FROM runs "
            f"WHERE status = 'ok' AND {self.condition} GROUP BY run_id"
        )


def mutation_sweeps(store: Store) -> list[str]:
    """Sweeps that compare mutation rates, by their plan or by their runs."""
    rates = store.query("SELECT sweep, count(DISTINCT mutation_rate) AS rates FROM runs GROUP BY sweep ORDER BY sweep")
    return [
        row.sweep
        for row in rates.itertuples()
        if row.rates > 1 or (row.sweep in store.plans and len(store.plans[row.sweep].mutation_rates) > 1)
    ]


def comparable(store: Store, sweeps: Sequence[str]) -> Selection:
    """The finished runs of ``sweeps`` at the setting that most of them have, task by task.

    Only tasks with goal points, which a success within 7 cm is known of.

    Raises:
        NoDataError: there is none; failed ones are counted in the message.
    """
    groups = store.query(f"""
        SELECT task, {", ".join(SETTING)}, count(DISTINCT run_id) AS n FROM runs
        WHERE status = 'ok' AND {among("sweep", sweeps)} AND robot = 'khepera' GROUP BY ALL
        ORDER BY n DESC, task, {", ".join(SETTING)}""")
    if groups.empty:
        raise NoDataError(f"{_why_none(store, sweeps)}; run {BEGIN}")
    chosen = groups.drop_duplicates("task")
    condition = " OR ".join(f"({_equals(row)})" for row in chosen[["task", *SETTING]].to_dict("records"))
    others = groups.drop(chosen.index)
    left_out = tuple(
        f"{counted(row.n, 'run')} of {row.task} with {row.evaluations} evaluations, "
        f"{row.generations_per_evaluation} generations and {row.training_iterations_per_evaluation} "
        "iterations each, or of another world or other bounds, left out"
        for row in others.itertuples()
    )
    tasks = sorted(zip(chosen.robot, chosen.task, strict=True), key=lambda pair: task_order(*pair))
    return Selection(
        tuple(sweeps), f"{among('sweep', sweeps)} AND ({condition})", int(chosen.n.sum()), tuple(tasks), left_out
    )


def _why_none(store: Store, sweeps: Sequence[str]) -> str:
    """Why none of ``sweeps``, or of all if there are none to choose from, has a run to count."""
    among_these = sweeps or store.query("SELECT DISTINCT sweep FROM runs").sweep.tolist()
    finished, failed = _finished(store, among_these), failures(store, among_these)
    if not finished:
        return f"{counted(failed, 'run')} failed and none finished"
    but = f", {failed:,} failed" if failed else ""
    return f"no sweep compares mutation rates ({counted(finished, 'finished run')}{but})"


def _equals(values: dict[str, Any]) -> str:
    return " AND ".join(
        among(name, [value]) if isinstance(value, str) else f"{name} = {value}" for name, value in values.items()
    )


def failures(store: Store, sweeps: Sequence[str]) -> int:
    """How many runs of ``sweeps`` broke and were not carried out again with success."""
    return int(
        store.query(f"""SELECT count(*) AS n FROM (SELECT run_id FROM runs WHERE {among("sweep", sweeps)}
        GROUP BY run_id HAVING count(*) FILTER (status = 'ok') = 0)""").n[0]
    )


@dataclass(frozen=True)
class Coverage:
    """How much of what was planned is there, in words; ``missing`` says the same of what is not."""

    amount: str
    missing: tuple[str, ...]

    @property
    def sentences(self) -> tuple[str, ...]:
        """All of it, the amount first."""
        return self.amount, *(text for text in self.missing if text != self.amount)


def coverage(store: Store, sweeps: Sequence[str], n: int | None = None) -> Coverage:
    """What there is of ``sweeps``: ``n`` runs, of those that their files ask for.

    By default ``n`` is all finished runs of those sweeps that have a file; runs by hand have none.
    """
    plans = {sweep: store.plans[sweep] for sweep in sweeps if sweep in store.plans}
    whole, there = (
        _finished(store, list(plans)),
        _finished_cells(store, [name for name, plan in plans.items() if plan.cells]),
    )
    n = whole if n is None else n
    planned, cells = (sum(getattr(plan, what) for plan in plans.values()) for what in ("runs", "cells"))
    amount, missing = counted(n, "run"), []
    if n < planned:
        amount = f"{n:,} of {planned:,} runs so far"
        missing.append(amount)
    if there < cells:
        missing.append(f"{cells - there:,} of {counted(cells, 'combination')} without a finished run")
    if failed := failures(store, sweeps):
        missing.append(f"{counted(failed, 'failed run')} not shown")
    return Coverage(amount, tuple(missing))


def _finished(store: Store, sweeps: Sequence[str]) -> int:
    return int(
        store.query(f"SELECT count(DISTINCT run_id) AS n FROM runs WHERE status = 'ok' AND {among('sweep', sweeps)}").n[
            0
        ]
    )


def _finished_cells(store: Store, sweeps: Sequence[str]) -> int:
    return int(
        store.query(f"""SELECT count(*) AS n FROM (SELECT DISTINCT sweep, task, evaluations,
        {", ".join(name for name in PARAMETERS if name != "seed")}
        FROM runs WHERE status = 'ok' AND {among("sweep", sweeps)})""").n[0]
    )


def counted(n: int, noun: str) -> str:
    """``1 run``, ``1,200 runs``."""
    return f"{n:,} {noun}" if n == 1 else f"{n:,} {noun}s"


def percent(share: float) -> str:
    """0.1 as ``10 %``."""
    return f"{100 * share:g} %"


def task_title(robot: str, task: str) -> str:
    """Title of a task; its name, if this version has no such task."""
    try:
        return load_task(robot, task).title
    except SpecError:
        return task


def task_order(robot: str, task: str) -> tuple[str, str]:
    """Sort key: the source's order of tasks."""
    try:
        return load_task(robot, task).source, task
    except SpecError:
        return "unknown", task
