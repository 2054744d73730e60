"""What is in the results at one moment: readable parts and the runs in the journals."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

from bns.errors import StoreError
from bns.store.disk.files import StoreWarning, what_is_there
from bns.store.disk.journal import Frame, JournalFile, best_frames, fault_of, journals, read_journal
from bns.store.disk.parquet import READ_FAULTS, read_part
from bns.store.disk.parts import Part, Unreadable, check_version, find_parts, list_files
from bns.store.disk.whole import exchanged, lacking, without
from bns.store.schema import RECORDED, SCHEMAS

_TRIES = 20


@dataclass(frozen=True)
class Snapshot:
    """Parts by table, and the frames of each journal, every run once a journal.

    ``lacking``: by place, tables that its runs have rows in and that cannot be read; those runs are not finished.
    """

    results: Path
    parts: dict[str, list[Part]]
    journals: list[tuple[JournalFile, list[Frame]]]
    lacking: dict[str, tuple[str, ...]]

    @property
    def is_empty(self) -> bool:
        """Whether nothing was ever stored."""
        return not self.journals and not any(self.parts.values())


def snapshot(results: Path, sweep: str | None = None) -> Snapshot:
    """Look through ``results`` (one sweep of it) as it is now.

    Files that cannot be read, or are not as they were written, are left out with one StoreWarning each; so are
    named those that are gone.

    Raises:
        StoreError: a file has another schema version, or a folder cannot be read.
    """
    # Journals first: a run that is folded meanwhile is then seen twice, which is put right, and not missed.
    pending = [(file, _frames(file)) for file in journals(results, sweep)]
    parts, bad = _settled_parts(results, sweep)
    for part in (one for found in parts.values() for one in found):
        check_version(part, results)
    others = exchanged(parts)
    parts = without(parts, others)
    found = Snapshot(results, parts, pending, lacking(parts))
    _warn(bad + others)
    _warn_of_gone(found, {file.path for file in bad + others})
    for table in RECORDED:
        parts[table] = _counted(results, parts[table], parts["runs"])
    return found


def full_snapshot(results: Path) -> Snapshot:
    """`snapshot`, or a StoreError with the commands to begin with if there is nothing."""
    found = snapshot(results) if results.is_dir() else None
    if found is None or found.is_empty:
        raise StoreError(
            f"there are no results in {results}: {what_is_there(results)}. Make some with: "
            "bns sweep khepera-small, or: bns run; or name another folder with "
            "--results DIR."
        )
    return found


def _settled_parts(results: Path, sweep: str | None) -> tuple[dict[str, list[Part]], list[Unreadable]]:
    # A fold publishes "runs" last, so that whatever "runs" held before the other tables were listed has its
    # rows; a compaction removes from "runs" first. Many writers may fold all the time: what they add is left
    # for the next reader.
    for _ in range(_TRIES):
        runs = set(list_files(results, "runs", sweep))
        listed = {table: find_parts(results, table, sweep) for table in SCHEMAS}
        if runs <= set(list_files(results, "runs", sweep)):
            parts = {table: found for table, (found, _) in listed.items()}
            parts["runs"] = [part for part in parts["runs"] if part.path in runs]
            return parts, [one for _, unreadable in listed.values() for one in unreadable]
    raise StoreError(f"{results} changes faster than it can be read. Repeat the command in a moment.")


def _frames(file: JournalFile) -> list[Frame]:
    found = read_journal(file)
    if fault := fault_of(file, found):
        warnings.warn(
            f"{fault}; its {len(found.frames)} whole runs are read.",
            StoreWarning,
            stacklevel=4,
        )
    return best_frames(found.frames)


def _counted(results: Path, parts: list[Part], runs: list[Part]) -> list[Part]:
    # A fold publishes "runs" last and a compaction removes it first: rows without it are half a step, and are
    # elsewhere as well. Where nothing explains it the file with the runs was lost, and somebody should know.
    places = {part.place for part in runs}
    _warn(
        [
            Unreadable(part.path, f"there is no readable runs/{part.place}, which it belongs to")
            for part in parts
            if part.place not in places and _is_lost(results, part, runs)
        ]
    )
    return [part for part in parts if part.place in places]


def _is_lost(results: Path, part: Part, runs: list[Part]) -> bool:
    # In this order: a fold removes its journal after it has published "runs".
    if part.maker in {file.id for file in journals(results, part.sweep)}:
        return False
    if (results / "runs" / part.place).exists():
        return False  # published meanwhile, or unreadable and named already
    try:
        return not _run_ids([part]) <= _run_ids(runs)
    except READ_FAULTS:
        return False  # a compaction is moving them


def _warn_of_gone(found: Snapshot, named: set[Path]) -> None:
    """Name the parts that are gone, not ``named`` yet, that no other copy of their runs makes up for."""
    runs = found.parts["runs"] if found.lacking else []
    whole = {part.sweep: set[str]() for part in runs}
    for file, frames in found.journals:
        whole.setdefault(file.sweep, set()).update(frame.run_id for frame in frames)
    for part in (part for part in runs if part.place not in found.lacking):
        whole[part.sweep] |= _run_ids([part])
    for part in (part for part in runs if part.place in found.lacking):
        gone = [found.results / table / part.place for table in found.lacking[part.place]]
        if not named.intersection(gone) and not _run_ids([part]) <= whole[part.sweep]:
            warnings.warn(
                f"{', '.join(map(str, gone))}: gone, though {part.path} was written with it. "
                f"Its {part.rows} runs do not count as finished: sweep {part.sweep} does them again.",
                StoreWarning,
                stacklevel=4,
            )


def _run_ids(parts: list[Part]) -> set[str]:
    return {run for part in parts for run in read_part(part.path, ["run_id"])["run_id"].to_pylist()}


def _warn(bad: list[Unreadable]) -> None:
    for file in bad:
        again = "writes it again" if file.is_sweep_file else "repeats its runs"
        warnings.warn(
            f"{file.path} is skipped: {file.reason}. bns compact moves it to set-aside/, and the sweep {again}.",
            StoreWarning,
            stacklevel=4,
        )
