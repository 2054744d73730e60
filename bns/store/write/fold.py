"""From a journal to parquet parts, repeatable at every step."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path

import pyarrow as pa

from bns.store.disk.digest import digest_in
from bns.store.disk.files import STAGING, StoreWarning, on_the_way, partition, publish, remove, set_aside
from bns.store.disk.journal import Frame, JournalFile, Scan, best_frames, fault_of, read_journal
from bns.store.disk.parquet import part_bytes
from bns.store.schema import RECORDED


def fold_journal(results: Path, file: JournalFile) -> int:
    """Publish the runs of a journal nobody writes to, then remove it; the number of runs.

    One part a task and table, named after the journal: an interrupted fold is repeated over the same names.
    A journal with damage is copied to ``set-aside/`` first, with a StoreWarning.
    """
    found = read_journal(file)
    if fault := fault_of(file, found):
        _report_damage(results, file, found, fault)
    frames = best_frames(found.frames)
    for task in sorted({frame.task for frame in frames}):
        publish_part(results, file.sweep, task, f"part-{file.id}-0", [f for f in frames if f.task == task])
    remove(file.path)
    return len(frames)


def publish_part(results: Path, sweep: str, task: str, part: str, frames: list[Frame]) -> None:
    """Publish one part a table of what is in ``frames``."""
    tables = {name: [frame.tables[name] for frame in frames if name in frame.tables] for name in (*RECORDED, "runs")}
    given = {name: pa.concat_tables(parts) for name, parts in tables.items() if parts}
    publish_fold(results, sweep, task, part, given, {frame.spec_hash for frame in frames})


def publish_fold(
    results: Path,
    sweep: str,
    task: str,
    part: str,
    tables: Mapping[str, pa.Table],
    spec_hashes: Iterable[str],
    lost: Iterable[str] = (),
) -> None:
    """Publish one part a table. "runs" comes last: a run is there when its rows are, and it vouches for their digests.

    ``lost`` are tables that the runs had rows in which are no more: the runs do not count as finished.
    """
    digests, hashes = dict.fromkeys(lost, ""), sorted(spec_hashes)
    for name in (*RECORDED, "runs"):
        if name in tables:
            place = partition(results, name, sweep, task) / f"{part}.parquet"
            vouched = digests if name == "runs" else None
            data = part_bytes(name, tables[name], sweep, hashes, tables["runs"], task=task, parts=vouched)
            publish(data, staged(results, sweep, f"{part}-{name}-{task}"), place)
            digests.setdefault(name, digest_in(data))


def staged(results: Path, sweep: str, name: str) -> Path:
    """Where a file of ``sweep`` is built."""
    return results / STAGING / sweep / f"{name}.parquet"


def clear_staging(results: Path, sweep: str) -> None:
    """Remove what a killed writer of ``sweep`` left half built; only for the one that holds its lock."""
    for path in [*sorted(staged(results, sweep, "any").parent.glob("*.parquet")), *on_the_way(results, sweep)]:
        remove(path)


def _report_damage(results: Path, file: JournalFile, found: Scan, fault: str) -> None:
    copy = f", a copy is in {set_aside(results, file.path, found.data)}" if found.data else ""
    warnings.warn(
        f"{fault}; {len(found.frames)} whole runs of it are kept{copy}. Run the sweep again: it repeats what is missing.",
        StoreWarning,
        stacklevel=3,
    )
