"""The tables of a snapshot as DuckDB views, every run once."""

from __future__ import annotations

import warnings

import duckdb
import pyarrow as pa

from bns.store.disk.files import StoreWarning
from bns.store.disk.journal import Frame, JournalFile
from bns.store.read.counts import Miscounts, miscounts, suspects
from bns.store.read.scan import placed, scan
from bns.store.read.snapshot import Snapshot
from bns.store.record import STATUSES
from bns.store.schema import SCHEMAS, empty, read_columns

DAMAGED = "damaged"
"""The status, in the view `runs`, of a run that ended well and whose rows cannot all be read: a sweep does it again."""
# Best first: the best status; a folded copy before one in a journal; the first file by name.
_BEST_FIRST = "claim, journal, place"
_WHERE_FROM = pa.schema([(name, pa.string()) for name in ("sweep", "run_id", "place")])


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
    claims = [f"""SELECT sweep, run_id, place, true AS journal, CASE {rank} END AS claim, evaluations FROM store.runs"""]
    if found.parts["runs"]:
        claims.append(f"""
            SELECT sweep, run_id, place, false, CASE
                WHEN status = 'ok' AND place IN (SELECT place FROM store.lacking)
                THEN {len(STATUSES)} {rank} END, CASE WHEN status = 'ok' THEN evaluations ELSE 0 END
            FROM {placed(found.results / "runs", found.parts["runs"])}""")
    connection.execute(f"CREATE TABLE store.claims AS {' UNION ALL '.join(claims)}")
    wrong = _miscounted(connection, found)
    # Counting is much quicker than ranking, and nearly every run is there once.
    connection.execute(f"""CREATE TABLE store.losers AS SELECT sweep, run_id, place FROM store.claims
        SEMI JOIN (SELECT sweep, run_id FROM store.claims GROUP BY ALL HAVING count(*) > 1)
        USING (sweep, run_id)
        QUALIFY row_number() OVER (PARTITION BY sweep, run_id ORDER BY {_BEST_FIRST}) > 1
        UNION ALL SELECT sweep, run_id, place FROM store.strays""")
    connection.execute(f"""CREATE TABLE store.unfinished AS SELECT sweep, run_id FROM store.claims
        GROUP BY ALL HAVING min(claim) = {len(STATUSES)}""")
    _warn(connection, found, wrong)
    return {row[0] for row in connection.execute("SELECT DISTINCT place FROM store.losers").fetchall()}


def _miscounted(connection: duckdb.DuckDBPyConnection, found: Snapshot) -> Miscounts:
    """Lower the claims of runs that have lost rows, and fill store.strays with rows that belong to no run."""
    asked = connection.execute("SELECT place, sum(evaluations) FROM store.claims WHERE NOT journal GROUP BY place").fetchall()
    wrong = miscounts(connection, found.results, found.parts, suspects(found.parts, dict(asked)))
    for table, runs in (("short", wrong.short), ("strays", wrong.strays)):
        rows = [(place, run) for place, those in runs.items() for run in those]
        sweeps = [place.split("/")[0].removeprefix("sweep=") for place, _ in rows]
        columns = {"sweep": sweeps, "run_id": [run for _, run in rows], "place": [place for place, _ in rows]}
        if rows:
            _copy(connection, table, pa.table(columns, schema=_WHERE_FROM))
        else:  # DuckDB loads pandas for a table of Arrow's, which takes longer than all the rest
            connection.execute(f"CREATE TABLE store.{table} (sweep VARCHAR, run_id VARCHAR, place VARCHAR)")
    if wrong.short:
        connection.execute(f"""UPDATE store.claims SET claim = {len(STATUSES)}
            WHERE NOT journal AND (run_id, place) IN (SELECT (run_id, place) FROM store.short)""")
    return wrong


def _warn(connection: duckdb.DuckDBPyConnection, found: Snapshot, wrong: Miscounts) -> None:
    """Name the files that have lost rows of runs of which there is no other copy."""
    if not wrong.places:
        return
    lost = connection.execute("""SELECT place, sweep, count(*) FROM (
            SELECT * FROM store.short SEMI JOIN store.unfinished USING (sweep, run_id)
            UNION ALL SELECT * FROM store.strays ANTI JOIN store.claims USING (sweep, run_id))
        GROUP BY ALL ORDER BY ALL""").fetchall()
    for place, sweep, runs in lost:
        warnings.warn(
            f"{found.results / 'runs' / place} or a file of the same name beside it has lost rows (or has some twice): {runs} of "
            f"its runs do not count as finished. bns compact keeps a copy in set-aside/, and sweep {sweep} does them again.",
            StoreWarning,
            stacklevel=4,
        )


def _view(table: str, found: Snapshot, touched: set[str]) -> str:
    columns = ", ".join(f'"{name}"' for name in read_columns(table))
    if table == "specs":
        read = f" UNION ALL SELECT {columns} FROM {scan(found.parts[table])}" if found.parts[table] else ""
        return (
            f"SELECT * FROM (SELECT {columns} FROM store.specs{read}) "
            "QUALIFY row_number() OVER (PARTITION BY sweep, spec_hash ORDER BY written_at) = 1"
        )
    clean = [part for part in found.parts[table] if part.place not in touched]
    mixed = [part for part in found.parts[table] if part.place in touched]
    pieces = [f"SELECT {columns} FROM {_without_losers(f'SELECT * FROM store.{table}')}"]
    if clean:
        pieces.append(f"SELECT {columns} FROM {scan(clean)}")
    if mixed:
        pieces.append(f"SELECT {columns} FROM {_without_losers(f'SELECT * FROM {placed(found.results / table, mixed)}')}")
    rows = " UNION ALL ".join(pieces)
    if table == "runs":
        gone = "(sweep, run_id) IN (SELECT (sweep, run_id) FROM store.unfinished)"
        return f"SELECT * REPLACE (CASE WHEN {gone} THEN '{DAMAGED}' ELSE status END AS status) FROM ({rows})"
    return rows


def _without_losers(rows: str) -> str:
    return f"({rows}) AS copy ANTI JOIN store.losers USING (sweep, run_id, place)"
