"""SQL from outside: one SELECT over the views, which reads the results and nothing else, and writes nothing."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

import duckdb
import pyarrow as pa

from bns.errors import StoreError
from bns.store.read.scan import pattern
from bns.store.schema import SCHEMAS

MOST_ROWS, MOST_BYTES = 5_000_000, 1 << 29
_ROWS_AT_ONCE = 2_048
_LEVELS = ("", "/sweep=*", "/sweep=*/task=*")
_PARQUET_NAME = re.compile(r"""["']([^"']+\.parquet)["']""")
_EXPLAIN = re.compile(r"\s*EXPLAIN\s+(ANALYZE\s+)?", re.IGNORECASE)
_LINE = re.compile(r"^LINE (\d+):", re.M)


def answer(connection: duckdb.DuckDBPyConnection, results: Path, sql: str, *, bounded: bool = False) -> pa.Table:
    """The rows of ``sql`` over the views of ``connection``, which is locked to ``results`` from then on.

    ``bounded``: at most `MOST_ROWS` rows and `MOST_BYTES` are fetched, and DuckDB works with at most half of the memory.

    Of columns that share a name the second is called name_1, the third name_2, as DuckDB does in subqueries.

    Raises:
        StoreError: ``sql`` is not one SELECT (or EXPLAIN of one), gives too many rows, or DuckDB cannot carry it out.
        duckdb.IOException: a file went away or cannot be read.
    """
    try:
        if bounded:
            connection.execute(f"SET memory_limit = '{_half_of_memory_mib()}MiB'")
        _lock(connection, results)
        _check(connection, sql)
        rows = _fetched(connection, sql) if bounded else connection.sql(sql).to_arrow_table()
    except duckdb.IOException:
        raise
    except duckdb.Error as error:
        raise StoreError(f"DuckDB cannot answer {sql!r}: {error}{damage_hint(results, error)}") from error
    return rows.rename_columns(_distinct(rows.column_names))


def _fetched(connection: duckdb.DuckDBPyConnection, sql: str) -> pa.Table:
    """The rows, as long as they are not too many: they are counted as they come, and not made all at once."""
    reader = connection.sql(sql).to_arrow_reader(_ROWS_AT_ONCE)
    batches, rows, size = [], 0, 0
    for batch in _batches(reader, sql):
        batches.append(batch)
        rows, size = rows + batch.num_rows, size + batch.nbytes
        if rows > MOST_ROWS or size > MOST_BYTES:
            raise StoreError(
                f"{sql!r} gives more than {rows - batch.num_rows} rows; {MOST_ROWS} rows or {MOST_BYTES >> 20} MiB are fetched "
                "at most. Ask for fewer with WHERE or LIMIT, count or average them in the query, or read the files with bns.load."
            )
    return pa.Table.from_batches(batches, schema=reader.schema)


def _batches(reader: pa.RecordBatchReader, sql: str) -> Iterator[pa.RecordBatch]:
    try:
        yield from reader
    except OSError as error:  # what DuckDB throws while rows are made comes through Arrow as one of these
        if "IO Error" in str(error):
            raise duckdb.IOException(str(error)) from error
        raise StoreError(f"DuckDB cannot answer {sql!r}: {str(error).splitlines()[0]}") from error


def _half_of_memory_mib() -> int:
    return max(256, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2 >> 20)


def damage_hint(results: Path, error: duckdb.Error) -> str:
    """What to do about a damaged file, if that is what ``error`` is about; "" if not."""
    named = [Path(name) for name in _PARQUET_NAME.findall(str(error))]
    # What the decoder of parquet pages throws has no class of its own and names no file. A misspelled name in
    # a statement is no damage.
    if type(error) is duckdb.Error or any(path.is_file() and path.is_relative_to(results) for path in named):
        return f" If a file is damaged, bns compact --results {results} moves it to set-aside/."
    return ""


def _lock(connection: duckdb.DuckDBPyConnection, results: Path) -> None:
    # Last of all the lock itself: after it a statement can no longer undo the others.
    folders = [results, *_linked(results)]
    allowed = ", ".join(f"{_text(str(folder))}, {pattern(folder)}" for folder in folders)
    for setting in (
        "python_enable_replacements = false",
        "autoinstall_known_extensions = false",
        "autoload_known_extensions = false",
        # The views name their files as patterns, and DuckDB compares letter by letter.
        f"allowed_directories = [{allowed}]",
        "enable_external_access = false",
        "lock_configuration = true",
    ):
        connection.execute(f"SET {setting}")


def _linked(results: Path) -> list[Path]:
    """Where folders of the tables really lie that are links: DuckDB goes by that."""
    places = [place for table in SCHEMAS for below in _LEVELS for place in results.glob(f"{table}{below}")]
    return sorted({place.resolve() for place in places if place.is_symlink()} | {results.resolve()})


def _text(value: str) -> str:
    return "'" + value.replace("'", "''") + "'"


def _check(connection: duckdb.DuckDBPyConnection, sql: str) -> None:
    """StoreError if ``sql`` is anything but one SELECT, or EXPLAIN [ANALYZE] of one."""
    explained = _EXPLAIN.match(sql)
    asked = sql[explained.end() :] if explained else sql
    kinds = [statement.type for statement in connection.extract_statements(asked)]
    if kinds != [duckdb.StatementType.SELECT]:
        raise _refused(sql, ", ".join(kind.name for kind in kinds) or "no statement")
    try:
        # WITH a AS (COPY ... TO 'file') SELECT 1 is of type SELECT and writes; in a view DuckDB refuses it.
        connection.execute(f"CREATE OR REPLACE TEMP VIEW store_asked AS {asked}")
    except duckdb.Error:
        try:  # a plain mistake is reported here, in the words of the statement
            connection.execute(f"EXPLAIN\n{asked}")
        except duckdb.Error as error:
            raise type(error)(_LINE.sub(lambda found: f"LINE {int(found[1]) - 1}:", str(error))) from None
        raise _refused(sql, "a SELECT that writes, or one that cannot be a view") from None
    connection.execute("DROP VIEW store_asked")


def _refused(sql: str, found: str) -> StoreError:
    return StoreError(
        f"{sql!r} is {found}; only SELECT is allowed: one SELECT statement, or EXPLAIN of one. "
        'To keep the rows in a file use: bns query --csv "SELECT ..." > FILE, or bns.load and pandas.'
    )


def _distinct(names: list[str]) -> list[str]:
    taken: dict[str, None] = {}
    for name in names:
        candidate, count = name, 0
        while candidate in taken or (count and candidate in names):
            count += 1
            candidate = f"{name}_{count}"
        taken[candidate] = None
    return list(taken)
