"""One finished run as it goes into the store, and its Arrow tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
import pyarrow as pa

from bns.errors import StoreError, unknown_name
from bns.spec import RunSpec
from bns.store.provenance import Provenance
from bns.store.schema import PARAMETERS, RECORDED, SCHEMAS

STATUSES = ("ok", "quarantined", "failed")
"""Best first: where a run was tried several times, the best outcome is the one that counts."""

_RUN_DEFAULTS: Mapping[str, Any] = {"error": None, "world_digest": "", "peak_memory_mib": float("nan")}
_ELSEWHERE = tuple(field.name for field in fields(Provenance))
_RUN_REQUIRED = ("status", "started_at", "wall_s", "cpu_s", "attempts")


@dataclass(frozen=True)
class RunRecord:
    """A run that came to an end.

    ``run`` holds status (ok, failed, quarantined), started_at (datetime with a zone), wall_s, cpu_s, attempts
    and, where known, error, world_digest and peak_memory_mib; with the columns of `Provenance` where the run was
    carried out by another machine than it is stored by. ``tables`` maps table names to columns of equal
    length without the identity columns; a run that is not ok has none. ``heard``: warnings that came meanwhile; not stored.
    """

    spec: RunSpec
    run: Mapping[str, Any]
    tables: Mapping[str, Mapping[str, np.ndarray]] = field(default_factory=dict)
    heard: tuple[str, ...] = ()


def record_tables(record: RunRecord, provenance: Provenance) -> dict[str, pa.Table]:
    """Arrow tables of one run in the schema of this version; "runs" is always there and has one row.

    Raises:
        StoreError: a table or column is unknown, missing, ragged, empty where it may not be, of another type.
    """
    run = _checked_run(record)
    unknown = sorted(set(record.tables) - set(RECORDED))
    if unknown:
        raise StoreError(unknown_name("table", unknown[0], RECORDED))
    given = [name for name in RECORDED if name in record.tables]
    tables = {name: table_of(name, record.spec, record.tables[name]) for name in given}
    evaluations = tables["evals"].num_rows if "evals" in tables else 0
    row = {**provenance.columns(), **run, "spec": record.spec.canonical_json(), "evaluations": evaluations}
    tables["runs"] = table_of("runs", record.spec, {name: [value] for name, value in row.items()})
    return tables


def table_of(name: str, spec: RunSpec, columns: Mapping[str, Any]) -> pa.Table:
    """Table ``name`` of one run: its identity columns, then ``columns`` (name -> values of equal length)."""
    schema = SCHEMAS[name]
    own = [field for field in schema if field.name not in _identity(schema)]
    where = f"table {name} of run {spec.run_id}"
    columns = _with_empty(own, columns)
    _check_names(where, columns, [field.name for field in own])
    rows = _common_length(where, columns)
    identity = {"run_id": spec.run_id, "robot": spec.robot, **{key: getattr(spec, key) for key in PARAMETERS}}
    repeated = [
        pa.repeat(pa.scalar(identity[field.name], field.type), rows)
        for field in schema
        if field.name in _identity(schema)
    ]
    return pa.table([*repeated, *(_array(where, field, columns[field.name]) for field in own)], schema=schema)


def _with_empty(own: list[pa.Field], columns: Mapping[str, Any]) -> dict[str, Any]:
    """Columns that may be empty and are not given, as those of another kind of robot, filled with nothing."""
    rows = len(next(iter(columns.values()), ()))
    return {field.name: [None] * rows for field in own if field.nullable} | dict(columns)


def _identity(schema: pa.Schema) -> tuple[str, ...]:
    # Only evals and runs carry the parameters; "world" is their first.
    return ("run_id", "robot", *PARAMETERS) if "world" in schema.names else ("run_id", "robot")


def _checked_run(record: RunRecord) -> dict[str, Any]:
    where = f"the runs row of {record.spec.run_id}"
    missing = [name for name in _RUN_REQUIRED if name not in record.run]
    if missing:
        raise StoreError(f"{where} has no {missing[0]!r}; it needs {', '.join(_RUN_REQUIRED)}.")
    extra = sorted(set(record.run) - set(_RUN_REQUIRED) - set(_RUN_DEFAULTS) - set(_ELSEWHERE))
    if extra:
        raise StoreError(f"{where}: {unknown_name('column', extra[0], [*_RUN_REQUIRED, *_RUN_DEFAULTS])}")
    status = record.run["status"]
    if status not in STATUSES:
        raise StoreError(f"{where}: {unknown_name('status', status, STATUSES)}")
    if (status == "ok") != ("evals" in record.tables) or (status != "ok" and record.tables):
        given = ", ".join(record.tables) or "none"
        raise StoreError(
            f"{where} has status {status!r} and the tables: {given}. "
            "A run that is ok needs evals; any other has no tables."
        )
    return {**_RUN_DEFAULTS, **record.run}


def _check_names(where: str, columns: Iterable[str], wanted: list[str]) -> None:
    given = set(columns)
    missing = [name for name in wanted if name not in given]
    if missing:
        raise StoreError(f"{where} has no column {', '.join(missing)}; it needs {', '.join(wanted)}.")
    extra = sorted(given - set(wanted))
    if extra:
        raise StoreError(f"{where}: {unknown_name('column', extra[0], wanted)}")


def _common_length(where: str, columns: Mapping[str, Any]) -> int:
    lengths = {name: len(values) for name, values in columns.items()}
    first, rows = next(iter(lengths.items()))
    ragged = [name for name, length in lengths.items() if length != rows]
    if ragged:
        raise StoreError(
            f"{where}: column {ragged[0]!r} has {lengths[ragged[0]]} values and {first!r} has "
            f"{rows}; all columns need the same length."
        )
    return rows


def _array(where: str, field: pa.Field, values: Any) -> pa.Array:
    kind = values.dtype.kind if isinstance(values, np.ndarray) else "O"
    # Arrow takes NaN for True: a truth value that is not known must be None or masked.
    if pa.types.is_boolean(field.type) and kind not in "bO":
        raise StoreError(
            f"{where}: column {field.name!r} is {values.dtype}; it must be bool "
            "(an object array with None, or a masked one, where a value is not known)."
        )
    try:
        array = pa.array(values, type=field.type)
    except (pa.ArrowInvalid, pa.ArrowTypeError, pa.ArrowNotImplementedError) as error:
        raise StoreError(f"{where}: column {field.name!r} must be {field.type}: {error}") from error
    if array.null_count and not field.nullable:
        raise StoreError(f"{where}: column {field.name!r} has an empty value, which it may not have.")
    return array
