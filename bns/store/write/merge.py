"""Compaction of one sweep: new files are published before the old ones go; readers take every run once."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import duckdb
import pyarrow as pa

from bns.store.disk.files import publish, remove, set_aside
from bns.store.disk.journal import journals
from bns.store.disk.parquet import file_bytes, joined_hashes, read_part, renewed_metadata
from bns.store.disk.parts import Part, check_version, find_parts
from bns.store.disk.whole import exchanged, lacking, without
from bns.store.read.counts import miscounts, suspects
from bns.store.record import STATUSES
from bns.store.schema import RECORDED, SCHEMA_VERSION, SCHEMAS, upgraded
from bns.store.write.fold import clear_staging, fold_journal, publish_fold, staged

FEWEST_RUNS, MOST_RUNS = 100, 200
"""Runs that a file should hold: fewer slow the readers down, more make every change costly."""

_INCOMPLETE = len(STATUSES)


@dataclass
class Tally:
    """What was done so far: runs recovered, copies dropped, files upgraded, paths of what was set aside."""

    recovered: int = 0
    dropped: int = 0
    upgraded: int = 0
    set_aside: list[Path] = field(default_factory=list)


@dataclass(frozen=True)
class _Fold:
    """The parts of one place, by table, and the runs whose copy here is the one that counts."""

    place: str
    parts: dict[str, Part]
    kept: frozenset[str]
    lost: tuple[str, ...]  # tables that the runs have rows in and that are not there
    whole: bool  # every run that counts here and is ok has all of its rows here
    short: frozenset[str]  # runs that have lost rows here and of which there is no better copy
    strays: frozenset[str]  # runs that have rows here, and none in "runs"

    @property
    def runs(self) -> Part:
        return self.parts["runs"]

    @property
    def must_go(self) -> bool:
        """Whether there are rows in it that do not count."""
        return len(self.kept) < self.runs.rows

    @property
    def old_files(self) -> int:
        return sum(_is_old(part) for part in self.parts.values())


def compact_sweep(root: Path, sweep: str, tally: Tally) -> None:
    """Bring one sweep in order; only for the one that holds its lock."""
    clear_staging(root, sweep)
    tally.recovered += sum(fold_journal(root, file) for file in journals(root, sweep))
    tables = _readable(root, sweep, tally)
    for part in tables["specs"]:
        _upgrade_alone(root, part, tally)
    folds = _folds(root, tables)
    _clear_orphans(root, tables, folds, tally)
    _keep_remains(root, folds, tally)
    for task in sorted({fold.runs.task for fold in folds}):
        for group in _groups([fold for fold in folds if fold.runs.task == task]):
            _rewrite(root, sweep, task, group)
            tally.dropped += sum(fold.runs.rows - len(fold.kept) - len(fold.short) for fold in group)
            tally.upgraded += sum(fold.old_files for fold in group)


def _readable(root: Path, sweep: str, tally: Tally) -> dict[str, list[Part]]:
    """Parts by table; files that are not as they were written are set aside, verified afresh whatever is remembered."""
    found = {table: find_parts(root, table, sweep, afresh=True) for table in SCHEMAS}
    tables = {table: parts for table, (parts, _) in found.items()}
    for part in (part for parts in tables.values() for part in parts):
        if part.version > SCHEMA_VERSION:
            check_version(part, root)
    others = exchanged(tables)
    tally.set_aside += [set_aside(root, file.path) for _, bad in found.values() for file in bad]
    tally.set_aside += [set_aside(root, file.path) for file in others]
    return without(tables, others)


def _is_old(part: Part) -> bool:
    """Whether the file must be written anew: for its schema version, or because it has no digest."""
    return part.version < SCHEMA_VERSION or not part.digest


def _upgrade_alone(root: Path, part: Part, tally: Tally) -> None:
    if _is_old(part):
        data = file_bytes(part.table, _rows(part), renewed_metadata(part.metadata))
        publish(data, staged(root, part.sweep, part.path.stem), part.path)
        tally.upgraded += 1


def _folds(root: Path, tables: dict[str, list[Part]]) -> list[_Fold]:
    """The folds of a sweep by place, with what counts in each: best status first, then first place."""
    by_place = {name: {part.place: part for part in parts} for name, parts in tables.items()}
    gaps = lacking(tables)
    rows = {place: _claimed(part) for place, part in by_place["runs"].items()}
    asked = {place: sum(count for _, status, count in those if status == "ok") for place, those in rows.items()}
    with duckdb.connect() as connection:
        wrong = miscounts(connection, root, tables, suspects(tables, asked))
    best: dict[str, tuple[int, str]] = {}
    for place, those in rows.items():
        for run, status, _ in those:
            lost = status == "ok" and (place in gaps or run in wrong.short.get(place, ()))
            claim = (_INCOMPLETE if lost else STATUSES.index(status), place)
            best[run] = min(claim, best.get(run, claim))
    kept: dict[str, set[str]] = {place: set() for place in by_place["runs"]}
    short: dict[str, set[str]] = {place: set() for place in by_place["runs"]}
    incomplete = {place for rank, place in best.values() if rank == _INCOMPLETE and place in gaps}
    for run, (rank, place) in best.items():
        (short if rank == _INCOMPLETE and place not in gaps else kept)[place].add(run)
    names = ("runs", *RECORDED)
    return [
        _Fold(
            place,
            {name: by_place[name][place] for name in names if place in by_place[name]},
            frozenset(kept[place]),
            gaps.get(place, ()),
            place not in incomplete,
            frozenset(short[place]),
            wrong.strays.get(place, frozenset()),
        )
        for place in sorted(kept)
    ]


def _claimed(part: Part) -> list[tuple[str, str, int]]:
    columns = read_part(part.path, ["run_id", "status", "evaluations"]).to_pydict()
    return list(zip(columns["run_id"], columns["status"], columns["evaluations"], strict=True))


def _keep_remains(root: Path, folds: list[_Fold], tally: Tally) -> None:
    """Copy the files with what is left of runs that have lost rows: new files leave it out, and the sweep does them again."""
    known = {run for fold in folds for run in fold.kept}
    for fold in (fold for fold in folds if fold.short or not fold.strays <= known):
        tally.set_aside += [set_aside(root, part.path, part.path.read_bytes()) for part in fold.parts.values()]


def _clear_orphans(root: Path, tables: dict[str, list[Part]], folds: list[_Fold], tally: Tally) -> None:
    """Parts without runs are what an interrupted compaction left, unless what they hold is nowhere else."""
    places = {fold.place for fold in folds}
    known = {run for fold in folds if fold.whole for run in fold.kept}
    for part in (part for name in RECORDED for part in tables[name] if part.place not in places):
        if set(read_part(part.path, ["run_id"])["run_id"].unique().to_pylist()) <= known:
            remove(part.path)
        else:
            tally.set_aside.append(set_aside(root, part.path))


def _groups(folds: list[_Fold]) -> list[list[_Fold]]:
    """Folds to be rewritten together, in order of place; each group makes one file a table."""
    alone = [[fold] for fold in folds if not fold.whole or not fold.kept]
    merged: list[list[_Fold]] = [[]]
    for fold in (fold for fold in folds if fold.whole and fold.kept):
        if len(fold.kept) < FEWEST_RUNS or fold.must_go or fold.old_files:
            if _size(merged[-1]) >= FEWEST_RUNS or _size([*merged[-1], fold]) > MOST_RUNS:
                merged.append([])
            merged[-1].append(fold)
    if len(merged) > 1 and _size(merged[-2] + merged[-1]) <= MOST_RUNS:
        merged[-2:] = [merged[-2] + merged[-1]]
    return [
        group for group in alone + merged if len(group) > 1 or any(fold.must_go or fold.old_files for fold in group)
    ]


def _size(group: Iterable[_Fold]) -> int:
    return sum(len(fold.kept) for fold in group)


def _rewrite(root: Path, sweep: str, task: str, group: list[_Fold]) -> None:
    """Publish what counts in ``group`` as one fold, "runs" last; then remove its files, "runs" first."""
    tables = {
        table: _gathered(table, group) for table in ("runs", *RECORDED) if any(table in fold.parts for fold in group)
    }
    if tables["runs"].num_rows:
        hashes = joined_hashes(fold.runs.metadata for fold in group)
        lost = {table for fold in group if not fold.whole for table in fold.lost}
        publish_fold(root, sweep, task, _name(group), tables, hashes, lost)
    for table in ("runs", *RECORDED):
        for fold in group:
            if table in fold.parts:
                remove(fold.parts[table].path)


def _name(group: list[_Fold]) -> str:
    # Of what goes in, so that an interrupted compaction is repeated over the same names. It sorts before the
    # journals' names: where both stand, the merged file is the one that counts.
    text = "\n".join([str(SCHEMA_VERSION), *(fold.place for fold in group)])
    return f"part-c{hashlib.sha256(text.encode()).hexdigest()[:32]}-0"


def _gathered(table: str, group: list[_Fold]) -> pa.Table:
    import pyarrow.compute as pc  # noqa: PLC0415  # slow to load, and a sweep without a compaction does without it

    pieces = [SCHEMAS[table].empty_table()]
    for fold in group:
        if table in fold.parts:
            rows = _rows(fold.parts[table])
            pieces.append(rows.filter(pc.is_in(rows["run_id"], pa.array(sorted(fold.kept), pa.string()))))
    return pa.concat_tables(piece.replace_schema_metadata(None) for piece in pieces)


def _rows(part: Part) -> pa.Table:
    return upgraded(part.table, read_part(part.path), part.version)
