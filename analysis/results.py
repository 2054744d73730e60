"""The results as the figures see them: one snapshot, asked in SQL, and the plans of its sweeps."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property, wraps
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

import duckdb
import pandas as pd

from analysis.labels import CELL
from bns import store as results_store
from bns.errors import BnsError, SpecError, StoreError
from bns.spec import FIELDS
from bns.store.archive.kept import NEAR, RECORDED, rounded_evals, rounded_rows
from bns.store.archive.read import archives, connect_archives, recorded_tables
from bns.sweep.expand.grid import parse_stored

BEGIN = "bns sweep khepera-small --budget 10m"
OF_RUNS = ("runs", "evals", "paths", "generations", "probes")
"""Tables whose rows belong to a run."""
PUBLISHED = Path("published") / "study.parquet"
"""The archive in the repository, below the folder of the results."""
FROM_RUNS = "carry out the sweep and draw it from the runs"
_TRIES = 5
_EVER = ", ".join(f"ever_{name} AS {name}" for name in ("success", *NEAR))
P = ParamSpec("P")
R = TypeVar("R")


class NoDataError(BnsError):
    """The store has nothing for a figure; the message says what would feed it."""


@dataclass(frozen=True)
class Plan:
    """What the newest file of a sweep asks for; ``cells`` and ``varied`` are empty if it cannot be read."""

    runs: int
    cells: int
    varied: frozenset[str]
    """Those of the compared parameters that take more than one value."""
    asked: frozenset[tuple[Any, ...]] = frozenset()
    """The combinations themselves, with the robot: two sweeps may ask for the same."""
    numbers: range = range(0)
    """The seeds of each."""

    @property
    def seeds(self) -> int:
        """Runs that are asked for of each combination; all of them, if the combinations are not known."""
        return self.runs // max(self.cells, 1)


class Results:
    """The results in one folder as they are now: all figures of one call show the same runs; with ``run``, that run alone.

    The same from an archive (`bns archive`), which has fewer tables and columns. Measures are rounded to what an
    archive keeps, so both give the same numbers. With ``so_far`` each success is that of any fittest controller up to then:
    another reading of section 4.5's "a trial run which developed a controller".

    Raises:
        StoreError: there is no run at all, or not this one; the message says what to do.
    """

    def __init__(
        self, results: Path | str, run: str | None = None, *, archived: bool = False, so_far: bool = False
    ) -> None:
        self.results, self.run, self.archived, self.so_far = Path(results), run, archived, so_far
        self._tables: dict[str, str] = {}
        self.memory: dict[tuple[Any, ...], Any] = {}
        written = archived or any((self.results / name).is_dir() for name in ("runs", "journal"))
        if not written or not self.query("SELECT count(*) AS n FROM runs").n[0]:
            what = "are no runs" if run is None else f"is no run {run}"
            raise StoreError(
                f"there {what} in {self.results} to draw. Make some with: {BEGIN}; or name another folder with --results DIR."
            )

    def query(self, sql: str) -> pd.DataFrame:
        """Rows of a SELECT over the tables of the store and those of `keep`."""
        for _ in range(_TRIES):
            try:
                return self._connection.execute(sql).df()
            except (duckdb.BinderException, duckdb.CatalogException) as lacking:
                if not self.archived:
                    raise
                what = _lacking(lacking)
                raise NoDataError(f"an archive does not hold what this is drawn from ({what}); {FROM_RUNS}") from None
            except duckdb.IOException as error:  # a compaction has replaced files: the new ones hold the same rows
                fault = error
                self.__dict__.pop("_connection", None)
        raise StoreError(f"cannot read {self.results}: {fault}. Repeat the command in a moment.")

    def keep(self, name: str, sql: str) -> str:
        """Hold the rows of a SELECT in memory as table ``name``, once for all figures; the name."""
        if name not in self._tables:
            self.query(f"CREATE OR REPLACE TABLE {name} AS {sql}")
            self._tables[name] = sql
        return name

    @cached_property
    def _connection(self) -> duckdb.DuckDBPyConnection:
        connection = connect_archives(archives(self.results)) if self.archived else results_store.connect(self.results)
        only = "true" if self.run is None else among("run_id", [self.run])
        for table in (*OF_RUNS[:2], *recorded_tables(connection)) if self.archived else OF_RUNS:
            rows = f"memory.main.{table}"
            if not self.archived and table in RECORDED:
                rows = f"({rounded_rows(rows, table)})"
            rows = f"({rounded_evals(rows)})" if table == "evals" and not self.archived else rows
            rows = f"(SELECT * REPLACE ({_EVER}) FROM {rows})" if table == "evals" and self.so_far else rows
            connection.execute(f"CREATE TEMP VIEW {table} AS SELECT * FROM {rows} WHERE {only}")
        for name, sql in self._tables.items():
            connection.execute(f"CREATE TABLE {name} AS {sql}")
        return connection

    @cached_property
    def plans(self) -> dict[str, Plan]:
        """By sweep, what its newest file asks for; sweeps that were written without one are absent."""
        newest = self.query(
            "SELECT sweep, arg_max(text, written_at) AS text, arg_max(runs, written_at) AS runs "
            "FROM specs GROUP BY sweep ORDER BY sweep"
        )
        return {row.sweep: _plan(row.sweep, row.text, row.runs) for row in newest.itertuples()}


def _lacking(fault: Exception) -> str:
    """The column or table that a database says it lacks, or what it says."""
    first = str(fault).partition("\n")[0].partition(": ")[2]
    found = re.search(r'([Cc]olumn) "([\w.]+)"|(Table) with name ([\w.]+)', first)
    return f"{found[1] or found[3]} {found[2] or found[4]}".lower() if found else first


def _plan(name: str, text: str, runs: float) -> Plan:
    try:
        sweep = parse_stored(text, name)
    except SpecError:  # written for another version of bns: its size is known all the same
        return Plan(0 if pd.isna(runs) else int(runs), 0, frozenset())
    varied = {
        name for name in CELL if len({float(combo.get(name, FIELDS[name].default)) for combo in sweep.combos}) > 1
    }
    fields = [field for name, field in FIELDS.items() if name not in {"robot", "seed"}]
    asked = {(sweep.robot, *(combo.get(field.name, field.default) for field in fields)) for combo in sweep.combos}
    return Plan(sweep.total, len(sweep.combos), frozenset(varied), frozenset(asked), sweep.all_seeds)


def planned_runs(plans: Iterable[Plan]) -> int:
    """How many runs several sweeps ask for; what two of them ask for is one run."""
    seeds: dict[tuple[Any, ...], set[int]] = {}
    unread = 0
    for plan in plans:
        unread += 0 if plan.asked else plan.runs
        for combination in plan.asked:
            seeds.setdefault(combination, set()).update(plan.numbers)
    return unread + sum(map(len, seeds.values()))


def remembered(work: Callable[Concatenate[Results, P], R]) -> Callable[Concatenate[Results, P], R]:
    """Let what ``work`` finds in a store be found once for all figures; its other arguments must be hashable."""

    @wraps(work)
    def find(store: Results, *arguments: P.args, **named: P.kwargs) -> R:
        key = (work, arguments, tuple(sorted(named.items())))
        if key not in store.memory:
            store.memory[key] = work(store, *arguments, **named)
        return store.memory[key]

    return find


def among(column: str, values: Iterable[str]) -> str:
    """SQL: ``column`` is one of ``values``; of none, if there are none."""
    listed = ", ".join("'" + value.replace("'", "''") + "'" for value in values)
    return f"{column} IN ({listed})" if listed else "false"
