"""What a writer does before it goes on: files of its sweep that are not as they were written are moved out of the way."""

from __future__ import annotations

import warnings
from pathlib import Path

from bns.store.disk.files import StoreWarning, set_aside
from bns.store.disk.parts import find_parts
from bns.store.disk.whole import exchanged
from bns.store.schema import SCHEMAS


def set_aside_damaged(results: Path, sweep: str) -> list[Path]:
    """Move damaged parts of ``sweep`` to ``set-aside/``, with a StoreWarning each; only for the one that holds its lock.

    The runs that had rows in them are not finished from then on, so that the sweep does them again. Returns the new paths.
    """
    found = {table: find_parts(results, table, sweep) for table in SCHEMAS}
    bad = [file for _, unreadable in found.values() for file in unreadable]
    bad += exchanged({table: parts for table, (parts, _) in found.items()})
    moved = []
    for file in bad:
        moved.append(set_aside(results, file.path))
        again = "It is written again" if file.is_sweep_file else "Its runs are repeated"
        warnings.warn(
            f"{file.path} is set aside as {moved[-1]}: {file.reason}. {again}.",
            StoreWarning,
            stacklevel=4,
        )
    return moved
