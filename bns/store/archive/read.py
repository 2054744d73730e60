"""Archives as the tables that figures ask: ``runs``, ``evals`` and ``specs``, with the columns that an archive keeps."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import duckdb
import pyarrow.parquet as pq

from bns.errors import StoreError
from bns.store.archive.kept import (
    COMPARED,
    COMPARED_RUN,
    DECIMALS,
    FORMAT,
    NEAR,
    RECORDED,
    RECORDING,
    RECORDING_RUN,
    RUN_COLUMNS,
    WHOSE,
    recorded_column,
)
from bns.store.disk.digest import is_intact, is_sealed
from bns.store.disk.parquet import READ_FAULTS
from bns.store.read.reader import finished
from bns.store.read.scan import pattern
from bns.store.schema import METADATA_KEY, PARAMETERS

ARCHIVED = "archived"
"""Folder in the results: archives whose runs count as done."""
_SPECS = ("sweep", "spec_hash", "written_at", "text", "runs")


def archives(place: Path | str) -> list[Path]:
    """The archives that ``place`` names: itself if it is a file, else the parquet files in that folder, by name.

    Raises:
        StoreError: there is none.
    """
    path = Path(place)
    found = [path] if path.is_file() else sorted(path.glob("*.parquet"))
    if not found:
        raise StoreError(
            f"there is no archive at {path}: give a file that bns archive wrote, or a folder of such files (*.parquet)."
        )
    return found


def described(path: Path) -> dict[str, Any]:
    """What an archive says of itself: runs, engine_versions, spec_hashes, git_sha, versions, specs (the sweeps' files).

    Raises:
        StoreError: it is no archive, one of another format, or not as it was written.
    """
    try:
        said = json.loads((pq.read_metadata(path).metadata or {})[METADATA_KEY])
        if "archive" in said and is_sealed(path) and not is_intact(path):
            raise StoreError(f"{path} is not as it was written: it was changed or truncated. Fetch or make it again.")
    except READ_FAULTS:
        said = {}
    if said.get("archive") != FORMAT:
        why = f"has format {said['archive']}, and this bns reads {FORMAT}" if "archive" in said else "is no archive"
        raise StoreError(f"{path} {why}. Make one from the results: bns archive results -o {path.with_suffix('.parquet').name}")
    return dict(said)


def stored_archives(results: Path | str) -> list[Path]:
    """The archives in the folder ``results``/archived, by name; usually none."""
    return sorted((Path(results) / ARCHIVED).glob("*.parquet"))


def archived(results: Path | str, sweep: str) -> list[tuple[str, str, str, str, str]]:
    """The runs of a sweep that lie in archives in the folder ``results``/archived: run_id, status, task, world, world_digest.

    They count as done, and `archive` writes them together with the new ones: so a study continues on another machine.

    Raises:
        StoreError: a file there is no archive, or not as it was written.
    """
    files = stored_archives(results)
    if not files:
        return []
    with connect_archives(files) as connection:
        columns = "run_id, status, task, world, world_digest"
        return connection.execute(f"SELECT {columns} FROM runs WHERE sweep = ? ORDER BY run_id", [sweep]).fetchall()


def recorded(results: Path | str, sweep: str) -> dict[str, str]:
    """Status of every run of a sweep by run id: those in the results, as `finished` gives them, and those in their archives."""
    done = finished(results, sweep)
    if not stored_archives(results):
        return done
    return {run: status for run, status, *_ in archived(results, sweep)} | done


def connect_archives(paths: Sequence[Path]) -> duckdb.DuckDBPyConnection:
    """A DuckDB connection with the views runs, evals and specs over archives. A run that several of them have counts once.

    One that is ok counts only with all of its evaluations.

    There are views generations, probes and paths as well if an archive has runs that recorded them.

    Raises:
        StoreError: a file is no archive, or not as it was written.
    """
    plans = [plan for path in paths for plan in described(path)["specs"]]
    connection = duckdb.connect()
    connection.execute("SET TimeZone = 'UTC'")
    files = ", ".join(pattern(path) for path in paths)
    connection.execute(f"""CREATE TABLE archived AS SELECT * FROM read_parquet([{files}], union_by_name = true)
        WHERE status <> 'ok' OR len(success_bits) = evaluations
        QUALIFY row_number() OVER (PARTITION BY sweep, run_id ORDER BY status <> 'ok') = 1""")
    there = set(connection.table("archived").columns)
    columns = (*RUN_COLUMNS, *(name for name in (*COMPARED_RUN, *RECORDING_RUN) if name in there))
    connection.execute(f"CREATE VIEW runs AS SELECT {', '.join(columns)} FROM archived")
    measures = DECIMALS | {name: decimals for name, decimals in (COMPARED | RECORDING).items() if name in there}
    connection.execute(f"CREATE VIEW evals AS {_evals(measures)}")
    for table, columns_of in RECORDED.items():
        if recorded_column(table, next(iter(columns_of))) in there:
            connection.execute(f"CREATE VIEW {table} AS {_recorded_rows(table)}")
    import pandas as pd  # noqa: PLC0415  # as above

    connection.register("plans", pd.DataFrame(plans, columns=list(_SPECS)).astype(dict.fromkeys(_SPECS[:4], str)))
    connection.execute("CREATE TABLE specs AS SELECT DISTINCT * REPLACE (written_at::TIMESTAMPTZ AS written_at) FROM plans")
    return connection


def recorded_tables(connection: duckdb.DuckDBPyConnection) -> list[str]:
    """Which of generations, probes and paths the archives of `connect_archives` hold."""
    views = {name for (name,) in connection.execute("SELECT view_name FROM duckdb_views()").fetchall()}
    return [table for table in RECORDED if table in views]


def _evals(decimals: Mapping[str, int]) -> str:
    """SELECT of a row an evaluation; ``decimals`` of the measures that the archives have."""
    parameters = ", ".join(PARAMETERS)
    lists = ", ".join(f"unnest({name}) AS {name}" for name in (*WHOSE, *decimals))
    successes = [
        _bit(column, place, f"{prefix}{name}", known=not place)
        for column, prefix in WHOSE.items()
        for place, name in enumerate(("success", *NEAR))
    ]
    measures = [f"{name} / {10**places}.0 AS {name}" for name, places in decimals.items()]
    return f"""SELECT run_id, sweep, robot, task, {parameters}, evaluation::INTEGER AS evaluation,
        {", ".join((*successes, *measures))} FROM (
            SELECT run_id, sweep, robot, task, {parameters}, radii,
                   unnest(range(1, len(success_bits) + 1)) AS evaluation, {lists} FROM archived)"""


def _recorded_rows(table: str) -> str:
    """SELECT of the rows of a table that runs recorded."""
    lists = ", ".join(f"unnest({recorded_column(table, name)}) AS {name}" for name in RECORDED[table])
    values = ", ".join(f"{name} / {10**places}.0 AS {name}" if places else name for name, places in RECORDED[table].items())
    return f"SELECT run_id, sweep, robot, task, {values} FROM (SELECT run_id, sweep, robot, task, {lists} FROM archived)"


def _bit(column: str, place: int, name: str, *, known: bool) -> str:
    """A success out of its bits; empty, unless ``known``, where a task has no goal point."""
    value = f"({column} & {1 << place}) > 0"
    return f"{value} AS {name}" if known else f"CASE WHEN radii THEN {value} END AS {name}"
