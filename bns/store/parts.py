"""Which parquet files there are, and which of them can be read."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from bns.errors import StoreError
from bns.store.files import explained
from bns.store.parquet import READ_FAULTS
from bns.store.schema import METADATA_KEY, SCHEMA_VERSION, SCHEMAS


@dataclass(frozen=True)
class Part:
    """One published file. ``place`` is its path below the table's folder, the same for all of a fold."""

    path: Path
    table: str
    sweep: str
    task: str
    place: str
    rows: int
    version: int
    metadata: bytes

    @property
    def maker(self) -> str:
        """Id of the journal or compaction that the part is named after."""
        return self.path.stem.split("-")[1] if "-" in self.path.stem else ""


@dataclass(frozen=True)
class Unreadable:
    """A file that is passed over, and why."""

    path: Path
    reason: str


def list_files(results: Path, table: str, sweep: str | None = None) -> list[Path]:
    """Every file of one table (of one sweep) that looks like parquet, by path."""
    root = results / table if sweep is None else results / table / f"sweep={sweep}"
    with explained("list", root):
        return sorted(root.rglob("*.parquet")) if root.is_dir() else []


def find_parts(results: Path, table: str, sweep: str | None = None) -> tuple[list[Part], list[Unreadable]]:
    """The parts of one table (of one sweep), by path, and the files there that are none."""
    parts: list[Part] = []
    bad: list[Unreadable] = []
    for path in list_files(results, table, sweep):
        try:
            part = _part(results, table, path)
        except FileNotFoundError:
            continue  # compacted between listing and opening
        if isinstance(part, Part):
            parts.append(part)
        else:
            bad.append(part)
    return parts, bad


def check_version(part: Part, results: Path) -> None:
    """StoreError naming the remedy if ``part`` has another schema version than this bns."""
    if part.version < SCHEMA_VERSION:
        raise StoreError(
            f"{part.path} has schema version {part.version}, older than {SCHEMA_VERSION}, which "
            f"this bns reads. Rewrite it with: bns compact --results {results}"
        )
    if part.version > SCHEMA_VERSION:
        raise StoreError(
            f"{part.path} has schema version {part.version}, newer than {SCHEMA_VERSION}, which "
            "this bns reads. Update bns: pip install -U bns"
        )


def _part(results: Path, table: str, path: Path) -> Part | Unreadable:
    inside = path.relative_to(results / table)
    folders = [folder.partition("=") for folder in inside.parts[:-1]]
    if [name for name, _, _ in folders] != (["sweep"] if table == "specs" else ["sweep", "task"]):
        return Unreadable(path, "it does not stand in a folder sweep=NAME/task=TASK")
    stat = path.stat()
    footer = _footer(str(path), stat.st_mtime_ns, stat.st_size)
    if isinstance(footer, str):
        return Unreadable(path, footer)
    rows, names, text = footer
    known = _described(text)
    if known.get("table") != table or not isinstance(known.get("schema_version"), int):
        return Unreadable(path, f"it was not written by bns as a file of table {table}")
    if known["schema_version"] == SCHEMA_VERSION and names != tuple(SCHEMAS[table].names):
        return Unreadable(path, f"its columns are not those of schema version {SCHEMA_VERSION}")
    sweep, task = [value for _, _, value in folders] if table != "specs" else (folders[0][2], "")
    return Part(path, table, sweep, task, str(inside), rows, known["schema_version"], text)


# A published file never changes, so its name, time and size stand for what is in it.
@lru_cache(maxsize=65_536)
def _footer(path: str, _mtime_ns: int, _size: int) -> tuple[int, tuple[str, ...], bytes] | str:
    try:
        footer = pq.read_metadata(path)
        text = (footer.metadata or {}).get(METADATA_KEY, b"{}")
        return footer.num_rows, tuple(footer.schema.names), text
    except FileNotFoundError:
        raise
    except READ_FAULTS as error:
        return f"it is truncated or no parquet file ({str(error).splitlines()[0]})"


def _described(text: bytes) -> dict[str, Any]:
    try:
        known = json.loads(text)
    except ValueError:
        return {}
    return known if isinstance(known, dict) else {}
