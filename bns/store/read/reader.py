"""The only way out of the results: tables as data frames or SQL, every run once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import duckdb
import pyarrow as pa

from bns.errors import StoreError, unknown_name
from bns.store.read.question import answer, damage_hint
from bns.store.read.snapshot import Snapshot, full_snapshot, snapshot
from bns.store.read.views import DAMAGED, connect_views
from bns.store.schema import SCHEMAS, SORT_KEYS, read_columns

if TYPE_CHECKING:  # half a second to load, and a run needs no table
    import pandas as pd

Where = str | Mapping[str, Any] | None
_T = TypeVar("_T")
_TRIES = 5
FINISHED = f"""SELECT sweep, run_id, status FROM runs
    LEFT JOIN (SELECT sweep, run_id, count(*) AS stored FROM evals GROUP BY ALL) USING (sweep, run_id)
    WHERE status <> '{DAMAGED}' AND (status <> 'ok' OR stored = evaluations)"""
"""Over a connection of `connect`: the runs that are really there, as `finished` gives them."""
_NULLABLE = {field.name for schema in SCHEMAS.values() for field in schema if field.nullable}


def connect(results: Path | str) -> duckdb.DuckDBPyConnection:
    """A DuckDB connection with the views evals, runs, specs, paths, generations and probes.

    The views show the results as they are now, finished runs that still stand in a journal included; for
    later runs connect again. A view is empty where nothing was stored yet. In runs the status of a run that ended well, and some
    rows of which are gone or cannot be read, is "damaged".

    Raises:
        StoreError: nothing is stored, or a file has another schema version (the message names the command).
    """
    root = Path(results)
    return _settled(root, lambda: connect_views(full_snapshot(root)))


def query(results: Path | str, sql: str) -> pd.DataFrame:
    """The rows that the SELECT statement ``sql`` gives over the views of `connect`.

    Nothing is written and no file outside ``results`` is read. Columns that share a name are numbered: success,
    success_1. At most 5 million rows or 512 MiB are fetched: `load` and `connect` have no such bound.

    Raises:
        StoreError: as in `connect`, ``sql`` is not one SELECT (or EXPLAIN), or DuckDB cannot carry it out.
    """
    return _frame(_answer(Path(results), sql, bounded=True))


def load(
    results: Path | str, table: str = "evals", columns: Sequence[str] | None = None, where: Where = None
) -> pd.DataFrame:
    """Rows of one table, in an order that does not depend on when the runs finished.

    Args:
        results: the folder of all results.
        table: evals, runs, specs, paths, generations or probes.
        columns: the columns wanted, in this order; all of them by default.
        where: an SQL condition ("mutation_rate > 0.1") or a mapping of columns to the value or values wanted.

    Truth values that may be unknown (success_7cm on a task without a goal point) have pandas' "boolean" type.

    Raises:
        StoreError: as in `query`, or there is no such table or column.
    """
    return _frame(_loaded(results, table, columns, where))


def load_rows(
    results: Path | str, table: str = "evals", columns: Sequence[str] | None = None, where: Where = None
) -> list[tuple[Any, ...]]:
    """As `load`, a tuple a row: for what has no use for pandas, which takes long to load."""
    return list(zip(*_loaded(results, table, columns, where).to_pydict().values(), strict=True))


def _loaded(results: Path | str, table: str, columns: Sequence[str] | None, where: Where) -> pa.Table:
    valid = read_columns(table)
    if isinstance(columns, str):
        raise StoreError(f"columns is {columns!r}; it must be a list of names: [{columns!r}].")
    wanted = list(valid if columns is None else columns)
    for name in [*wanted, *(where if isinstance(where, Mapping) else ())]:
        if name not in valid:
            raise StoreError(unknown_name(f"column of {table}", name, valid))
    order = ", ".join(["sweep", *SORT_KEYS[table]])
    sql = f"SELECT {', '.join(map(_quoted, wanted))} FROM {table} WHERE {_condition(where)} ORDER BY {order}"
    return _answer(Path(results), sql)


def finished(results: Path | str, sweep: str) -> dict[str, str]:
    """Status of every run of ``sweep`` that is really there, by run id; empty where there is none.

    A run that is ok counts only with all of its evaluations in evals, and with every table that it was written with.
    """
    return _settled(Path(results), lambda: _finished(snapshot(Path(results), sweep)))


def _finished(found: Snapshot) -> dict[str, str]:
    if not found.journals and not found.parts["runs"]:
        return {}
    with connect_views(found) as connection:
        return dict(connection.execute(f"SELECT run_id, status FROM ({FINISHED}) ORDER BY run_id").fetchall())


def _answer(results: Path, sql: str, *, bounded: bool = False) -> pa.Table:
    return _settled(results, lambda: _answer_once(full_snapshot(results), sql, bounded))


def _answer_once(found: Snapshot, sql: str, bounded: bool) -> pa.Table:
    with connect_views(found) as connection:
        return answer(connection, found.results, sql, bounded=bounded)


def _settled(results: Path, work: Callable[[], _T]) -> _T:
    """What ``work`` gives; it is repeated when files go away under it, because a compaction replaces them."""
    fault: duckdb.Error | None = None
    for _ in range(_TRIES):
        try:
            return work()
        except duckdb.IOException as error:
            fault = error
    hint = damage_hint(results, fault) if fault is not None else ""
    raise StoreError(f"cannot read {results}: {fault}.{hint}") from fault


def _condition(where: Where) -> str:
    if where is None:
        return "true"
    if isinstance(where, str):
        return f"({where})"
    allowed = {name: ", ".join(map(_literal, _listed(value))) for name, value in where.items()}
    return " AND ".join(f"{_quoted(name)} IN ({values})" for name, values in allowed.items()) or "true"


def _quoted(name: str) -> str:
    return f'"{name}"'


def _listed(value: Any) -> list[Any]:
    values = [value] if isinstance(value, str) or not hasattr(value, "__iter__") else list(value)
    return values or [None]


def _literal(value: Any) -> str:
    plain = value.item() if hasattr(value, "item") else value
    if plain is None:
        return "NULL"
    if isinstance(plain, bool | int | float):
        return repr(plain)
    if isinstance(plain, str):
        return "'" + plain.replace("'", "''") + "'"
    raise StoreError(
        f"a condition cannot compare with {value!r}; give a text, a number or a truth value, "
        "or write the condition as SQL."
    )


def _frame(table: pa.Table) -> pd.DataFrame:
    # Arrow gives truth values with gaps as objects, which neither average nor fit in memory.
    import pandas as pd  # noqa: PLC0415  # as above

    frame: pd.DataFrame = table.to_pandas(types_mapper={pa.bool_(): pd.BooleanDtype()}.get)
    certain = [
        field.name
        for field in table.schema
        if pa.types.is_boolean(field.type) and field.name not in _NULLABLE and not table[field.name].null_count
    ]
    return frame.astype(dict.fromkeys(certain, bool))
