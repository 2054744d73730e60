"""Which folds are whole: what a "runs" part vouches for is there, and is what it was written with."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from bns.store.disk.parquet import READ_FAULTS, read_part
from bns.store.disk.parts import Part, Unreadable
from bns.store.schema import RECORDED

Tables = Mapping[str, list[Part]]
_KEPT_BY_RECORD = {"paths": ("paths",), "full": ("paths", "generations", "probes")}


def exchanged(tables: Tables) -> list[Unreadable]:
    """Parts that are sound in themselves, but others than the runs of their place were written with."""
    vouched = {part.place: part.vouched for part in tables["runs"] if part.vouched is not None}
    return [
        Unreadable(part.path, f"it is not the file that runs/{part.place} was written with")
        for name in RECORDED
        for part in tables[name]
        if part.place in vouched and vouched[part.place].get(name) != part.digest
    ]


def without(tables: Tables, bad: list[Unreadable]) -> dict[str, list[Part]]:
    """``tables`` without the parts that are ``bad``."""
    paths = {file.path for file in bad}
    return {name: [part for part in parts if part.path not in paths] for name, parts in tables.items()}


def lacking(tables: Tables) -> dict[str, tuple[str, ...]]:
    """By place, the tables that its runs have rows in and that are not there; only of places that lack any."""
    there = {(name, part.place) for name in RECORDED for part in tables[name]}
    wanted = {part.place: _wanted(part) for part in tables["runs"]}
    gaps = {place: tuple(name for name in names if (name, place) not in there) for place, names in wanted.items()}
    return {place: names for place, names in gaps.items() if names}


def _wanted(part: Part) -> tuple[str, ...]:
    if part.vouched is not None:
        return tuple(part.vouched)
    return _wanted_by_record(part.path)


# A published file never changes; one that is written anew vouches for its tables.
@lru_cache(maxsize=65_536)
def _wanted_by_record(path: Path) -> tuple[str, ...]:
    """What must stand beside a "runs" part from before digests, by what its runs were asked to record."""
    try:
        rows = read_part(path, ["spec", "status"]).to_pylist()
    except READ_FAULTS:
        return ()  # it went away under the reader
    specs = [row["spec"] for row in rows if row["status"] == "ok"]
    wanted = {"evals"} if specs else set()
    for record, names in _KEPT_BY_RECORD.items():
        if any(f'"record":"{record}"' in spec for spec in specs):
            wanted |= set(names)
    return tuple(name for name in RECORDED if name in wanted)
