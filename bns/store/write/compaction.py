"""Bring the results into few, current, readable files; every step can be cut off and repeated."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from bns.errors import StoreError
from bns.store.disk.files import is_name, set_aside, what_is_there
from bns.store.disk.journal import journals
from bns.store.disk.lock import SweepLock, SweepLockedError
from bns.store.disk.parts import find_parts
from bns.store.schema import SCHEMAS
from bns.store.write.merge import Tally, compact_sweep


@dataclass(frozen=True)
class CompactSummary:
    """What `compact` did. Files are counted over all tables; the last two name what was left out."""

    files_before: int
    files_after: int
    recovered_runs: int
    dropped_copies: int
    upgraded_files: int
    set_aside: tuple[Path, ...]
    skipped_sweeps: tuple[str, ...]

    def __str__(self) -> str:
        lines = [
            f"{self.files_before} files before, {self.files_after} after; {self.recovered_runs} runs "
            f"recovered from journals, {self.dropped_copies} copies dropped, "
            f"{self.upgraded_files} files upgraded"
        ]
        lines += [f"not as it was written, set aside: {path}" for path in self.set_aside]
        lines += [f"skipped, being written: sweep {sweep}" for sweep in self.skipped_sweeps]
        return "\n".join(lines)


def compact(results: Path | str) -> CompactSummary:
    """Fold journals left behind, merge small files, upgrade old ones, drop copies, set aside the unreadable.

    A sweep that is being written is skipped. Evals read back are the same as before.

    Raises:
        StoreError: there is no such folder, the disk fails, or a file was written by a newer bns.
    """
    root = Path(results)
    if not root.is_dir():
        raise StoreError(f"there are no results in {root}: {what_is_there(root)}. Name another with --results DIR.")
    before, sweeps = _count(root), _sweeps(root)
    work, skipped = Tally(set_aside=_set_aside_strays(root)), []
    for sweep in sweeps:
        try:
            with SweepLock(root, sweep):
                compact_sweep(root, sweep, work)
        except SweepLockedError:
            skipped.append(sweep)
    return CompactSummary(
        before, _count(root), work.recovered, work.dropped, work.upgraded, tuple(work.set_aside), tuple(skipped)
    )


def bytes_per_run(results: Path | str, sweep: str) -> float:
    """Disk use of the folded files of ``sweep``, all tables, in bytes a run; NaN if it has none."""
    parts = [part for table in SCHEMAS for part in find_parts(Path(results), table, sweep)[0]]
    runs = sum(part.rows for part in parts if part.table == "runs")
    return sum(part.path.stat().st_size for part in parts) / runs if runs else float("nan")


def _count(root: Path) -> int:
    return sum(len(find_parts(root, table)[0]) for table in SCHEMAS)


def _sweeps(root: Path) -> list[str]:
    folders = [path for table in SCHEMAS for path in (root / table).glob("sweep=*")]
    names = {path.name.removeprefix("sweep=") for path in folders}
    return sorted({name for name in names if is_name(name)} | {file.sweep for file in journals(root)})


def _set_aside_strays(root: Path) -> list[Path]:
    """Move away the files that stand in no sweep's folder; those in one are for the holder of its lock."""
    strays = [
        file.path
        for table in SCHEMAS
        for file in find_parts(root, table)[1]
        if not is_name(file.path.relative_to(root / table).parts[0].removeprefix("sweep="))
    ]
    return [set_aside(root, path) for path in strays]
