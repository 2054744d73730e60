"""The tables of a snapshot as DuckDB views, every run once."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pyarrow as pa

from bns.store.disk.journal import Frame, JournalFile
from bns.store.disk.parts import Part
from bns.store.read.snapshot import Snapshot
from bns.store.record import STATUSES
from bns.store.schema import SCHEMAS, empty, read_columns

DAMAGED = "damaged"
"""The status, in the view `runs`, of a run that ended well and whose rows cannot all be read: a sweep does it again."""
_OPTIONS = "hive_partitioning=true, filename=true"
# Best first: the best status; a folded copy before one in a journal; the first file by name.
_BEST_FIRST = "claim, journal, place"


def connect_views(found: Snapshot) -> duckdb.DuckDBPyConnection:
    """An in-memory database with one view a table."""
    connection = duckdb.connect()
    connection.execute("SET TimeZone = 'UTC'")
    connection.execute("CREATE SCHEMA store")
    for table in SCHEMAS:
        _copy(connection, table, _journal_rows(table, found))
    touched = _find_duplicates(connection, found)
    for table in SCHEMAS:
        connection.execute(f"CREATE VIEW {table} AS {_view(table, found, touched)}")
    return connection


def _journal_rows(table: str, found: Snapshot) -> pa.Table:
    nothing = empty(table).append_column("place", pa.nulls(0, pa.string()))
    rows = [
        _with_place(frame, table, file) for file, frames in found.journals for frame in frames if table in frame.tables
    ]
    alike = [one.select(nothing.column_names).cast(nothing.schema) for one in rows]
    return pa.concat_tables([nothing, *alike])


def _with_place(frame: Frame, table: str, file: JournalFile) -> pa.Table:
    rows = frame.tables[table]
    for name, value in (("sweep", file.sweep), ("task", frame.task), ("place", file.id)):
        rows = rows.append_column(name, pa.repeat(value, rows.num_rows))
    return rows


def _copy(connection: duckdb.DuckDBPyConnection, table: str, rows: pa.Table) -> None:
    connection.register("arriving", rows)
    connection.execute(f"CREATE TABLE store.{table} AS SELECT * FROM arriving")
    connection.unregister("arriving")


def _find_duplicates(connection: duckdb.DuckDBPyConnection, found: Snapshot) -> set[str]:
    """Fill store.losers with the copies that do not count; the places (parts and journals) that hold any."""
    connection.execute("CREATE TABLE store.lacking (place VARCHAR)")
    if found.lacking:
        connection.register("arriving", pa.table({"place": list(found.lacking)}))
        connection.execute("INSERT INTO store.lacking SELECT place FROM arriving")
        connection.unregister("arriving")
    rank = " ".join(f"WHEN status = '{status}' THEN {rank}" for rank, status in enumerate(STATUSES))
    # A run some rows of which are gone is the worst claim of all, whatever its row says.
    claims = [f"""SELECT sweep, run_id, place, true AS journal, CASE {rank} END AS claim FROM store.runs"""]
    if found.parts["runs"]:
        claims.append(f"""
            SELECT sweep, run_id, place, false, CASE
                WHEN status = 'ok' AND place IN (SELECT place FROM store.lacking)
                THEN {len(STATUSES)} {rank} END
            FROM (SELECT *, {_place(found.results / "runs")} AS place FROM {_read(found.parts["runs"])})""")
    connection.execute(f"CREATE TABLE store.claims AS {' UNION ALL '.join(claims)}")
    # Counting is much quicker than ranking, and nearly every run is there once.
    connection.execute(f"""CREATE TABLE store.losers AS SELECT sweep, run_id, place FROM store.claims
        SEMI JOIN (SELECT sweep, run_id FROM store.claims GROUP BY ALL HAVING count(*) > 1)
        USING (sweep, run_id)
        QUALIFY row_number() OVER (PARTITION BY sweep, run_id ORDER BY {_BEST_FIRST}) > 1""")
    connection.execute(f"""CREATE TABLE store.unfinished AS SELECT sweep, run_id FROM store.claims
        GROUP BY ALL HAVING min(claim) = {len(STATUSES)}""")
    return {row[0] for row in connection.execute("SELECT DISTINCT place FROM store.losers").fetchall()}


def _view(table: str, found: Snapshot, touched: set[str]) -> str:
    columns = ", ".join(f'"{name}"' for name in read_columns(table))
    if table == "specs":
        read = f" UNION ALL SELECT {columns} FROM {_read(found.parts[table])}" if found.parts[table] else ""
        return (
            f"SELECT * FROM (SELECT {columns} FROM store.specs{read}) "
            "QUALIFY row_number() OVER (PARTITION BY sweep, spec_hash ORDER BY written_at) = 1"
        )
    clean = [part for part in found.parts[table] if part.place not in touched]
    mixed = [part for part in found.parts[table] if part.place in touched]
    pieces = [f"SELECT {columns} FROM {_without_losers(f'SELECT * FROM store.{table}')}"]
    if clean:
        pieces.append(f"SELECT {columns} FROM {_read(clean)}")
    if mixed:
        placed = f"SELECT *, {_place(found.results / table)} AS place FROM {_read(mixed)}"
        pieces.append(f"SELECT {columns} FROM {_without_losers(placed)}")
    rows = " UNION ALL ".join(pieces)
    if table == "runs" and found.lacking:
        gone = "(sweep, run_id) IN (SELECT (sweep, run_id) FROM store.unfinished)"
        return f"SELECT * REPLACE (CASE WHEN {gone} THEN '{DAMAGED}' ELSE status END AS status) FROM ({rows})"
    return rows


def _without_losers(rows: str) -> str:
    return f"({rows}) AS copy ANTI JOIN store.losers USING (sweep, run_id, place)"


def _place(folder: Path) -> str:
    return f"substr(filename, {len(str(folder)) + 2})"


def _read(parts: list[Part]) -> str:
    names = ", ".join(pattern(part.path) for part in parts)
    # Typed as text: a name like 0012 is no number.
    folders = "{'sweep': VARCHAR}" if parts[0].table == "specs" else "{'sweep': VARCHAR, 'task': VARCHAR}"
    return f"read_parquet([{names}], {_OPTIONS}, hive_types={folders})"


def pattern(path: Path) -> str:
    """``path`` as a quoted DuckDB text that stands for this path alone, whatever letters are in it."""
    # DuckDB takes names for patterns: what it would expand stands in a character class of its own.
    text = "".join(f"[{letter}]" if letter in "*?[" else letter for letter in str(path))
    return "'" + text.replace("'", "''") + "'"
