"""Which parquet files there are, and which of them can be read."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from bns.errors import StoreError
from bns.store.disk.digest import FIELD, Identity, Memory, identity, is_intact, is_sealed
from bns.store.disk.files import explained
from bns.store.disk.parquet import READ_FAULTS, read_part
from bns.store.schema import METADATA_KEY, SCHEMA_VERSION, SCHEMAS

_KEYS_BEFORE_DIGESTS = {"schema_version", "table", "sweep", "spec_hash", "git_sha", "git_clean", "bns_version"}
_DEEPEST = 4
_Step = tuple[str, list[str], list[str]]


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
    digest: str = ""
    """Of the file, "" of one from before digests."""
    vouched: Mapping[str, str] | None = None
    """Of table "runs": digest of each of the fold's other tables; None in a file from before digests."""

    @property
    def maker(self) -> str:
        """Id of the journal or compaction that the part is named after."""
        return self.path.stem.split("-")[1] if "-" in self.path.stem else ""


@dataclass(frozen=True)
class Unreadable:
    """A file that is passed over, and why."""

    path: Path
    reason: str

    @property
    def is_sweep_file(self) -> bool:
        """Whether it lies in the table of the sweeps' own files (specs/sweep=NAME/FILE): it holds no runs."""
        return "specs" in self.path.parts[-4:-1]


def list_files(results: Path, table: str, sweep: str | None = None) -> list[Path]:
    """Every file of one table (of one sweep) that looks like parquet, by path; folders that are links are followed."""
    root = results / table if sweep is None else results / table / f"sweep={sweep}"
    with explained("list", root):
        walk = os.walk(root, followlinks=True) if root.is_dir() else ()
        found = [Path(folder) / name for folder, _, names in _down(walk, root) for name in names]
    return sorted(path for path in found if path.suffix == ".parquet" and not path.name.startswith("."))


def _down(walk: Iterable[_Step], root: Path) -> Iterator[_Step]:
    for folder, below, names in walk:
        if len(Path(folder).relative_to(root).parts) >= _DEEPEST:
            below.clear()  # links may lead round and round
        yield folder, below, names


def find_parts(
    results: Path, table: str, sweep: str | None = None, *, afresh: bool = False
) -> tuple[list[Part], list[Unreadable]]:
    """The parts of one table (of one sweep), by path, and the files there that are none or are not as they were written.

    A file is verified before it counts, and once only: as long as it keeps its size, times and inode; with ``afresh`` again.
    """
    parts: list[Part] = []
    bad: list[Unreadable] = []
    memory = _memory(results.absolute())
    for path in list_files(results, table, sweep):
        try:
            part = _part(results, table, path, memory, afresh)
        except FileNotFoundError:
            continue  # compacted between listing and opening
        if isinstance(part, Part):
            parts.append(part)
        else:
            bad.append(part)
    memory.save()
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


def _part(results: Path, table: str, path: Path, memory: Memory, afresh: bool) -> Part | Unreadable:
    inside = path.relative_to(results / table)
    folders = [folder.partition("=") for folder in inside.parts[:-1]]
    if [name for name, _, _ in folders] != (["sweep"] if table == "specs" else ["sweep", "task"]):
        return Unreadable(path, "it is not in a folder sweep=NAME/task=TASK")
    now = identity(path.stat())
    if not (memory.has(path, now) and not afresh):
        fault = _fault(path)
        if fault:
            return Unreadable(path, fault)
        memory.add(path, now)
    footer = _footer(str(path), now)
    if isinstance(footer, str):
        return Unreadable(path, footer)
    rows, names, text = footer
    known = _described(text)
    sweep, task = [value for _, _, value in folders] if table != "specs" else (folders[0][2], "")
    reason = _not_as_written(known, table, sweep, task)
    if not reason and known["schema_version"] == SCHEMA_VERSION and names != tuple(SCHEMAS[table].names):
        reason = f"its columns are not those of schema version {SCHEMA_VERSION}"
    if reason:
        return Unreadable(path, reason)
    digest, vouched = known.get(FIELD, ""), known.get("parts")
    return Part(path, table, sweep, task, str(inside), rows, known["schema_version"], text, digest, vouched)


def _not_as_written(known: dict[str, Any], table: str, sweep: str, task: str) -> str:
    """Why a file with this metadata cannot stand where it stands; "" if it can."""
    version = known.get("schema_version")
    if known.get("table") != table or not isinstance(version, int):
        return f"it was not written by bns as a file of table {table}"
    if version > SCHEMA_VERSION:
        return ""  # another bns says what is in it
    if FIELD not in known:
        # Older files name no digest. One that has lost it would look the same, but for its other keys.
        return "" if set(known) <= _KEYS_BEFORE_DIGESTS else "its metadata is damaged"
    if (known["sweep"], known["task"]) != (sweep, task):
        return f"it was written for sweep {known['sweep']!r}, task {known['task']!r}"
    return ""


@cache
def _memory(results: Path) -> Memory:
    return Memory(results)


def _fault(path: Path) -> str:
    """Why a file is not what was written, "" if it is; all of it is read."""
    try:
        if is_sealed(path):
            return "" if is_intact(path) else "it is damaged: its digest is not that of what was written"
        read_part(path)  # older ones have the checksums of their pages alone
    except FileNotFoundError:
        raise
    except READ_FAULTS as error:
        return _broken(error)
    return ""


# A published file never changes, so its name, times, inode and size stand for what is in it.
@lru_cache(maxsize=65_536)
def _footer(path: str, _now: Identity) -> tuple[int, tuple[str, ...], bytes] | str:
    try:
        footer = pq.read_metadata(path)
        text = (footer.metadata or {}).get(METADATA_KEY, b"{}")
        return footer.num_rows, tuple(footer.schema.names), text
    except FileNotFoundError:
        raise
    except READ_FAULTS as error:
        return _broken(error)


def _broken(error: BaseException) -> str:
    said = str(error).splitlines() or [type(error).__name__]
    return f"it is truncated or no parquet file ({said[0]})"


def _described(text: bytes) -> dict[str, Any]:
    try:
        known = json.loads(text)
    except ValueError:
        return {}
    return known if isinstance(known, dict) else {}
