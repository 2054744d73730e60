"""Columns of every result table, and the one version number that stands for all of them.

``sweep`` and ``task`` are folder names, not file columns; readers put them back in second and fourth place.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

import pyarrow as pa

from bns.errors import StoreError, unknown_name

SCHEMA_VERSION = 2
METADATA_KEY = b"bns"
FOLDER_COLUMNS = ("sweep", "task")
IDENTITY = ("run_id", "sweep", "robot", "task")
NEAR_CM = (7, 10, 14, 20)
"""Distances from the goal, cm, that the dissertation counts successes at (section 4.4)."""

_UTC = pa.timestamp("us", tz="UTC")


def _fields(kind: pa.DataType, names: str, *, nullable: bool = False) -> list[pa.Field]:
    return [pa.field(name, kind, nullable=nullable) for name in names.split()]


def _near(prefix: str) -> list[pa.Field]:
    # Nullable: only tasks with a goal point have a distance to it.
    return _fields(pa.bool_(), " ".join(f"{prefix}_{cm}cm" for cm in NEAR_CM), nullable=True)


_WHO = _fields(pa.string(), "run_id robot")
_PARAMETERS = [
    *_fields(pa.string(), "world approach"),
    *_fields(pa.int64(), "seed root_seed"),
    *_fields(pa.int32(), "population_size"),
    *_fields(pa.float64(), "tournament_size mutation_rate real_world_selection_size"),
    *_fields(pa.int32(), "generations_per_evaluation training_iterations_per_evaluation"),
    *_fields(pa.string(), "training_algorithm"),
    *_fields(pa.int32(), "min_commands max_commands"),
]
PARAMETERS = tuple(field.name for field in _PARAMETERS)

_EVALS = [
    *_fields(pa.int32(), "evaluation"),
    *_fields(pa.float64(), "diversity fitness_error fitness_simulation fitness_world"),
    *_fields(pa.float64(), "best_fitness mean_fitness"),
    *_near("success"),
    *_near("ever_success"),
    *_fields(pa.int32(), "goals_reached"),
    *_fields(pa.float64(), "evaluated_fitness_simulation evaluated_fitness_world evaluated_fitness_error"),
    *_near("evaluated_success"),
    *_fields(pa.int32(), "evaluated_goals_reached"),
    *_fields(pa.bool_(), "success evaluated_success ever_success"),
    *_fields(pa.float64(), "training_error validation_error"),
    *_fields(pa.int32(), "training_patterns validation_patterns commands fittest_commands"),
    *_fields(pa.float64(), "mean_commands driven_ms robot_s"),
    *_fields(pa.int32(), "generations"),
    *_fields(pa.int64(), "bound_hits arithmetic_failures"),
    *_fields(pa.float64(), "training_cpu_s evolution_cpu_s"),
]
_RUNS = [
    *_fields(pa.string(), "status"),
    *_fields(pa.string(), "error", nullable=True),
    *_fields(pa.string(), "spec world_digest git_sha"),
    *_fields(pa.bool_(), "git_clean", nullable=True),
    *_fields(pa.string(), "bns_version host versions"),
    *_fields(_UTC, "started_at"),
    *_fields(pa.float64(), "wall_s cpu_s peak_memory_mib"),
    *_fields(pa.int32(), "attempts evaluations"),
]
_PATHS = [
    *_fields(pa.int32(), "evaluation"),
    *_fields(pa.string(), "who"),
    *_fields(pa.int32(), "step"),
    # Commands and markers of one kind of robot are empty for another.
    *_fields(pa.float64(), "left_units right_units duration_ms", nullable=True),
    *_fields(pa.float64(), "a_lat_rad a_vert_rad omega_rad alpha_rad repeats", nullable=True),
    *_fields(pa.float64(), "x_m y_m heading_rad snn_x_m snn_y_m snn_heading_rad"),
    *_fields(pa.float64(), "yellow_x_m yellow_y_m green_x_m green_y_m", nullable=True),
    *_fields(pa.float64(), "snn_yellow_x_m snn_yellow_y_m snn_green_x_m snn_green_y_m", nullable=True),
    *_fields(pa.bool_(), "stable snn_stable", nullable=True),
]
_GENERATIONS = [
    *_fields(pa.int32(), "evaluation generation"),
    *_fields(pa.float64(), "best_fitness best_fitness_world mean_fitness"),
]
_PROBES = [*_fields(pa.int32(), "evaluation probe"), *_fields(pa.float64(), "distance_m change_m")]
_SPECS = [
    *_fields(pa.string(), "spec_hash"),
    *_fields(_UTC, "written_at"),
    *_fields(pa.string(), "text"),
    *_fields(pa.int64(), "runs", nullable=True),
]

SCHEMAS: Mapping[str, pa.Schema] = {
    "evals": pa.schema(_WHO + _PARAMETERS + _EVALS),
    "paths": pa.schema(_WHO + _PATHS),
    "generations": pa.schema(_WHO + _GENERATIONS),
    "probes": pa.schema(_WHO + _PROBES),
    "specs": pa.schema(_SPECS),
    "runs": pa.schema(_WHO + _PARAMETERS + _RUNS),
}
"""Columns that stand in the files of each table."""

RECORDED = ("evals", "paths", "generations", "probes")
"""Tables that a run itself fills."""

SORT_KEYS: Mapping[str, tuple[str, ...]] = {
    "evals": ("run_id", "evaluation"),
    "paths": ("run_id", "evaluation", "who", "step"),
    "generations": ("run_id", "evaluation", "generation"),
    "probes": ("run_id", "evaluation", "probe"),
    "specs": ("spec_hash",),
    "runs": ("run_id",),
}
"""The columns that put a table in an order that does not depend on when its runs finished."""


def read_columns(table: str) -> list[str]:
    """Columns of ``table`` as a reader sees them, in order; StoreError if there is no such table."""
    if table not in SCHEMAS:
        raise StoreError(unknown_name("table", table, SCHEMAS))
    names = SCHEMAS[table].names
    if table == "specs":
        return ["sweep", *names]
    return [*IDENTITY, *(name for name in names if name not in IDENTITY)]


def empty(table: str) -> pa.Table:
    """``table`` without rows, with the folder columns."""
    schema = SCHEMAS[table]
    folders = [pa.field(name, pa.string()) for name in read_columns(table) if name in FOLDER_COLUMNS]
    return pa.Table.from_batches([], pa.schema([*schema, *folders]))  # Schema.empty_table would load pandas


def file_metadata(
    table: str,
    sweep: str,
    *,
    spec_hash: str,
    git_sha: str,
    git_clean: bool | None,
    bns_version: str,
    task: str = "",
    parts: Mapping[str, str] | None = None,
) -> bytes:
    """The JSON that stands in every file's key-value metadata under ``METADATA_KEY``; its digest is added last.

    ``parts`` (of table "runs" alone): by name, the digests of the fold's other tables, "" of one that is lost.
    """
    vouched = {} if parts is None else {"parts": dict(parts)}
    return json.dumps(
        {
            "schema_version": SCHEMA_VERSION,
            "table": table,
            "sweep": sweep,
            "spec_hash": spec_hash,
            "git_sha": git_sha,
            "git_clean": git_clean,
            "bns_version": bns_version,
            "task": task,
            **vouched,
        }
    ).encode()


def _from_version_0(name: str, table: pa.Table) -> pa.Table:
    # Version 0 did not count arithmetic failures: a run with one of them did not finish, so there were none.
    if name != "evals" or "arithmetic_failures" in table.column_names:
        return table
    return table.append_column("arithmetic_failures", pa.repeat(pa.scalar(0, pa.int64()), table.num_rows))


def _from_version_1(name: str, table: pa.Table) -> pa.Table:
    # Version 1 knew one approach and no robot time: half a minute beside driving is what a spec says today by default.
    if "world" in SCHEMAS[name].names and "approach" not in table.column_names:
        table = table.append_column("approach", pa.repeat(pa.scalar("bns", pa.string()), table.num_rows))
    if name != "evals" or "robot_s" in table.column_names:
        return table
    rows = table.select(["run_id", "evaluation", "driven_ms"]).to_pylist()
    spent: dict[str, float] = {}
    robot_s = [0.0] * len(rows)
    for place in sorted(range(len(rows)), key=lambda i: (rows[i]["run_id"], rows[i]["evaluation"])):
        run, driven_s = rows[place]["run_id"], rows[place]["driven_ms"] / 1000.0
        spent[run] = robot_s[place] = spent.get(run, 0.0) + driven_s + 30
    return table.append_column("robot_s", pa.array(robot_s, pa.float64()))


UPGRADES: Mapping[int, Callable[[str, pa.Table], pa.Table]] = {0: _from_version_0, 1: _from_version_1}
"""From each older version to the next one; a new nullable column needs no entry of its own."""


def upgraded(name: str, table: pa.Table, version: int) -> pa.Table:
    """``table`` of an older (or this) schema version in this version's schema.

    Raises:
        StoreError: there is no way from that version, or a column is missing that may not be empty.
    """
    for step in range(version, SCHEMA_VERSION):
        if step not in UPGRADES:
            raise StoreError(
                f"table {name} has schema version {version}; this bns upgrades from "
                f"{min(UPGRADES)} to {SCHEMA_VERSION}. Install a bns that reads it."
            )
        table = UPGRADES[step](name, table)
    columns = [_column_or_nulls(name, table, field) for field in SCHEMAS[name]]
    return pa.table(columns, schema=SCHEMAS[name])


def _column_or_nulls(name: str, table: pa.Table, field: pa.Field) -> Any:
    if field.name in table.column_names:
        return table.column(field.name).cast(field.type)
    if not field.nullable:
        raise StoreError(
            f"table {name} has no column {field.name!r}, which may not be empty. "
            "The file was not written by bns, or by a version without an upgrade."
        )
    return pa.nulls(table.num_rows, field.type)
