"""An archive of results: every run of some sweeps as one row of a parquet file, with the sweeps' own files beside."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa
import pyarrow.parquet as pq

from bns.errors import StoreError, unknown_name
from bns.store.archive.kept import (
    COMPARED,
    COMPARED_RUN,
    DECIMALS,
    FORMAT,
    NEAR,
    RECORDED,
    RECORDED_ORDER,
    RECORDED_ROWS,
    RECORDING,
    RECORDING_RUN,
    RUN_COLUMNS,
    WHOSE,
    bits,
    recorded_column,
    whole,
)
from bns.store.archive.read import connect_archives, recorded_tables, stored_archives
from bns.store.disk.digest import BLANK, FIELD, sealed
from bns.store.disk.files import publish
from bns.store.read.reader import FINISHED, connect
from bns.store.schema import METADATA_KEY, PARAMETERS, SCHEMA_VERSION

_LEVEL = 19
"""Of zstd: an archive is written once and kept."""
_ORDER = ", ".join(
    ("sweep", "task", *(name for name in PARAMETERS if name not in ("seed", "root_seed")), "root_seed", "seed", "run_id")
)
_ENGINE = re.compile(r'"engine_version":(\d+)')


@dataclass(frozen=True)
class ArchiveSummary:
    """What was archived: ``path``, ``runs``, ``sweeps`` (name -> runs) and ``size_bytes``; ``left_out``: runs of the results that
    do not count as finished, since their evaluations are damaged or gone."""

    path: Path
    runs: int
    sweeps: dict[str, int]
    size_bytes: int
    left_out: int = 0

    def __str__(self) -> str:
        listed = ", ".join(f"{name} {count:,}" for name, count in self.sweeps.items())
        left_out = f"; {_lacking(self.left_out)}" if self.left_out else ""
        return f"{self.runs:,} runs ({listed}) in {self.path}, {self.size_bytes / 1e6:.2f} MB{left_out}"


def archive(results: Path | str, output: Path | str, sweeps: Sequence[str] | None = None) -> ArchiveSummary:
    """Write one parquet file from which figures and findings are drawn as from the results themselves.

    Args:
        results: the folder of all results; it is only read, and may grow meanwhile. Archives in its folder ``archived`` are
            kept with it: a study that goes on where its earlier results are no longer.
        output: the file to write; an older one is replaced as a whole.
        sweeps: names of the sweeps to keep; all by default.

    Kept of every run: parameters, seed, spec, versions, commit and, for every evaluation, successes at all radii (of the
    fittest, the evaluated, and so far), diversity, fitness error and fitness in the world of the fittest (to 0.001 per
    metre) and the length of its list; of sweeps with several approaches also the robot's time (to 0.1 s), the error of the
    evaluated's fitness and the CPU time of runs; of runs that recorded them (``record: full``) the fitness of every generation
    (to 0.0001 per metre), the probes (to 0.01 mm), the poses of the fittest's paths (to 0.1 mm) and the time of driving.
    Everything else stays in the results.

    Runs that do not count as finished are left out, and counted.

    Raises:
        StoreError: there are no results, no such sweep, no run to keep, or the file cannot be written; an older file stays.
    """
    path = Path(output)
    if path.suffix != ".parquet":
        raise StoreError(f"the archive is {str(path)!r}; it must be a file that ends in .parquet, for example study.parquet.")
    former = stored_archives(results)
    with connect(results) as connection:
        approaches = _approaches(connection, former)
        there = sorted({sweep for sweep, _ in approaches})
        for name in sweeps or ():
            if name not in there:
                raise StoreError(unknown_name(f"sweep in {results}", name, there))
        chosen = sorted(set(sweeps or there))
        connection.execute("CREATE TEMP TABLE chosen AS SELECT unnest(?::VARCHAR[]) AS sweep", [chosen])
        connection.execute(f"CREATE TEMP TABLE finished AS SELECT sweep, run_id FROM ({FINISHED}) SEMI JOIN chosen USING (sweep)")
        lacking = connection.execute("""SELECT sweep, run_id FROM runs SEMI JOIN chosen USING (sweep)
            ANTI JOIN finished USING (sweep, run_id)""").fetchall()
        recorded = _recorded(connection, former, chosen)
        select = _select(_comparing(approaches, chosen), recorded)
        table = connection.sql(select).to_arrow_table()
        plans = connection.sql("SELECT * FROM specs SEMI JOIN chosen USING (sweep) ORDER BY ALL").to_arrow_table().to_pylist()
    if former:
        table, plans = _with_former(table, plans, former, chosen)
    names = table["sweep"].to_pylist()
    left_out = len({*lacking} - {*zip(names, table["run_id"].to_pylist(), strict=True)})
    if not names:
        why = f": {_lacking(left_out)}" if left_out else ""
        raise StoreError(f"there is no finished run in {results} to archive{why}. Nothing was written.")
    data = _file_bytes(table, plans)
    publish(data, path.with_name(f".{path.name}.part"), path)
    return ArchiveSummary(path, len(names), {name: names.count(name) for name in chosen}, len(data), left_out)


def _lacking(runs: int) -> str:
    return f"{runs:,} run{'' if runs == 1 else 's'} left out, whose evaluations are damaged or gone: the sweep makes them again"


def _with_former(
    table: pa.Table, plans: list[dict[str, Any]], former: Sequence[Path], chosen: Sequence[str]
) -> tuple[pa.Table, list[dict[str, Any]]]:
    """The rows and the sweeps' files with those of the archives that lie in the results; a run that went well comes first."""
    with connect_archives(former) as connection:
        connection.register("stored", table)
        both: pa.Table = connection.sql(
            f"""SELECT * FROM (
                SELECT *, 0 AS place FROM stored
                UNION ALL BY NAME SELECT *, 1 AS place FROM archived WHERE list_contains(?, sweep))
            QUALIFY row_number() OVER (PARTITION BY sweep, run_id ORDER BY status <> 'ok', place) = 1 ORDER BY {_ORDER}""",
            params=[list(chosen)],
        ).to_arrow_table()
        older = connection.sql("SELECT * FROM specs WHERE list_contains(?, sweep)", params=[list(chosen)]).to_arrow_table()
    known = {(plan["sweep"], plan["spec_hash"]) for plan in plans}
    plans = [*plans, *(plan for plan in older.to_pylist() if (plan["sweep"], plan["spec_hash"]) not in known)]
    return both.select(table.column_names).cast(table.schema), sorted(plans, key=lambda plan: (plan["sweep"], plan["spec_hash"]))


def _approaches(connection: duckdb.DuckDBPyConnection, former: Sequence[Path]) -> set[tuple[str, str]]:
    """(sweep, approach) of all runs in the results and their archives together."""
    sql = "SELECT DISTINCT sweep, approach FROM runs"
    pairs = set(connection.execute(sql).fetchall())
    if former:
        with connect_archives(former) as older:
            pairs |= set(older.execute(sql).fetchall())
    return pairs


def _comparing(pairs: set[tuple[str, str]], chosen: Sequence[str]) -> list[str]:
    """Sweeps with several approaches."""
    return sorted(sweep for sweep, count in Counter(sweep for sweep, _ in pairs).items() if count > 1 and sweep in chosen)


def _recorded(
    connection: duckdb.DuckDBPyConnection, former: Sequence[Path], chosen: Sequence[str]
) -> dict[str, list[str]]:
    """Tables of `RECORDED` -> those sweeps that have rows in them, in the results or in their archives."""
    sweeps = {table: _with_rows(connection, table) for table in RECORDED}
    if former:
        with connect_archives(former) as older:
            sweeps |= {table: sweeps[table] | _with_rows(older, table) for table in recorded_tables(older)}
    return {table: found for table in RECORDED if (found := sorted(sweeps[table] & {*chosen}))}


def _with_rows(connection: duckdb.DuckDBPyConnection, table: str) -> set[str]:
    return {sweep for (sweep,) in connection.execute(f"SELECT DISTINCT sweep FROM {table}").fetchall()}


def _select(comparing: Sequence[str], recorded: Mapping[str, Sequence[str]]) -> str:
    """SELECT of one row a run, with a list of each thing that is kept of its evaluations and of the tables ``recorded``."""
    recording = sorted({sweep for sweeps in recorded.values() for sweep in sweeps})
    only = [(COMPARED_RUN, COMPARED, comparing), (RECORDING_RUN, RECORDING, recording)]
    lists = {column: f"({bits(prefix)})::UTINYINT" for column, prefix in WHOSE.items()}
    lists |= {name: whole(name) for name in DECIMALS}
    more = {name: whole(name) for _, measures, sweeps in only if sweeps for name in measures}
    listed = ", ".join(f"list({value} ORDER BY evaluation) AS {name}" for name, value in (lists | more).items())
    of_these = (
        f", CASE WHEN {_among(sweeps)} THEN {name} END AS {name.partition('.')[2]}"
        for run_columns, measures, sweeps in only
        if sweeps
        for name in (*(f"runs.{column}" for column in run_columns), *(f"kept.{measure}" for measure in measures))
    )
    columns = {table: [recorded_column(table, name) for name in RECORDED[table]] for table in recorded}
    details = (f", coalesce({table}_kept.{name}, []) AS {name}" for table, names in columns.items() for name in names)
    joined = (f"LEFT JOIN ({_lists_of(table)}) AS {table}_kept USING (run_id, sweep)" for table in recorded)
    return f"""
        SELECT {", ".join(f"runs.{name}" for name in RUN_COLUMNS)}, coalesce(radii, false) AS radii,
               {", ".join(f"coalesce(kept.{name}, []) AS {name}" for name in lists)}
               {"".join(of_these)} {"".join(details)}
        FROM runs SEMI JOIN finished USING (sweep, run_id)
        LEFT JOIN (SELECT run_id, sweep, count({NEAR[0]}) > 0 AS radii, {listed}
                   FROM evals SEMI JOIN chosen USING (sweep) GROUP BY run_id, sweep) AS kept USING (run_id, sweep)
        {" ".join(joined)}
        ORDER BY {_ORDER}"""


def _among(sweeps: Sequence[str]) -> str:
    return "sweep IN (" + ", ".join("'" + name.replace("'", "''") + "'" for name in sweeps) + ")"


def _lists_of(table: str) -> str:
    """SELECT of one row a run, with a list of each column that is kept of ``table``."""
    values = {name: whole(name) if decimals else name for name, decimals in RECORDED[table].items()}
    order = RECORDED_ORDER[table]
    lists = (f"list({value} ORDER BY {order}) AS {recorded_column(table, name)}" for name, value in values.items())
    rows = f"{table} SEMI JOIN chosen USING (sweep) WHERE {RECORDED_ROWS[table]}"
    return f"SELECT run_id, sweep, {', '.join(lists)} FROM {rows} GROUP BY run_id, sweep"


def _file_bytes(table: pa.Table, plans: list[dict[str, Any]]) -> bytes:
    recorded = [recorded_column(name, column) for name, of in RECORDED.items() for column, places in of.items() if places]
    measures = [name for name in (*DECIMALS, *COMPARED, *RECORDING, *recorded) if name in table.column_names]
    sink = pa.BufferOutputStream()
    pq.write_table(
        table.replace_schema_metadata({METADATA_KEY: _metadata(table, plans)}),
        sink,
        compression="zstd",
        compression_level=_LEVEL,
        use_dictionary=[name for name in table.column_names if name not in measures],
        column_encoding={f"{name}.list.element": "BYTE_STREAM_SPLIT" for name in measures},
        write_page_checksum=True,
    )
    return sealed(bytes(sink.getvalue()))


def _metadata(table: pa.Table, plans: list[dict[str, Any]]) -> bytes:
    """The sweeps' files and where the runs come from, as JSON; the digest of the file is added last."""
    texts = [{**plan, "written_at": plan["written_at"].isoformat()} for plan in plans]
    engines = {found[1] for text in table["spec"].to_pylist() if (found := _ENGINE.search(text or ""))}
    said = {
        "archive": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "runs": table.num_rows,
        "engine_versions": sorted(map(int, engines)),
        "spec_hashes": sorted({plan["spec_hash"] for plan in plans}),
        **{name: _all_of(table, name) for name in ("git_sha", "git_clean", "bns_version", "versions", "world_digest")},
        "specs": texts,
        FIELD: BLANK,
    }
    return json.dumps(said).encode()


def _all_of(table: pa.Table, column: str) -> list[Any]:
    return sorted({value for value in table[column].to_pylist() if value is not None}, key=str)
