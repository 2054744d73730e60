"""Parquet parts as DuckDB reads them, and how their paths are written in SQL."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bns.store.disk.parts import Part

_OPTIONS = "hive_partitioning=true, filename=true"


def scan(parts: Sequence[Part]) -> str:
    """SQL: the rows of these parts of one table (one at least), with the columns of their folders and ``filename``."""
    names = ", ".join(pattern(part.path) for part in parts)
    # Typed as text: a name like 0012 is no number.
    folders = "{'sweep': VARCHAR}" if parts[0].table == "specs" else "{'sweep': VARCHAR, 'task': VARCHAR}"
    alike = "" if len({part.version for part in parts}) == 1 else ", union_by_name=true"  # opens every file first
    return f"read_parquet([{names}], {_OPTIONS}{alike}, hive_types={folders})"


def placed(folder: Path, parts: Sequence[Part]) -> str:
    """The same, below the folder of their table, with ``place`` (`Part.place`)."""
    return f"(SELECT *, substr(filename, {len(str(folder)) + 2}) AS place FROM {scan(parts)})"


def pattern(path: Path) -> str:
    """``path`` as a quoted DuckDB text that stands for this path alone, whatever letters are in it."""
    # DuckDB takes names for patterns: what it would expand stands in a character class of its own.
    text = "".join(f"[{letter}]" if letter in "*?[" else letter for letter in str(path))
    return "'" + text.replace("'", "''") + "'"
