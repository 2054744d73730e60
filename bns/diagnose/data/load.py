"""Measurements from a file, as checked tracks."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.bodies.cycles import are_cycles, checked_cycles, cycle_tracks
from bns.diagnose.data.bodies.joints import are_joints, joint_tracks
from bns.diagnose.data.checks import Finding, checked, whole_names
from bns.diagnose.data.located import BEGINS, OF_A_LOG
from bns.diagnose.data.mapping import mapping_beside
from bns.diagnose.data.sources.read import read_table
from bns.diagnose.data.stamps import stamp_scatter
from bns.diagnose.data.tracker_faults import excursions, jumps, lasting, without_faults
from bns.diagnose.data.tracks import Tracks, tracks_of
from bns.errors import DataError, in_both
from bns.measurements import DISCARDED, POSE


@dataclass(frozen=True)
class Measured:
    """A file's tracks, what was odd about it, and its SHA-256 (20 digits), which names it in a model's provenance."""

    path: Path
    tracks: Tracks
    findings: tuple[Finding, ...]
    digest: str
    robot: str = ""
    """What a column ``robot`` says; "" where there is none."""
    table: pd.DataFrame = field(default_factory=pd.DataFrame, repr=False, compare=False)
    """The rows that the tracks were made of."""
    files: tuple[tuple[str, str], ...] = ()
    """Of several files taken together the name and the digest of each, "" where only some of its rows are there."""

    @property
    def called(self) -> str:
        """The names of all files."""
        return ", ".join(name for name, _ in self.files) or self.path.name


def load_measured(path: str | Path, robot: str | None = None, more: Sequence[Path] = ()) -> Measured:
    """Read, map (if ``DATA.import.yaml`` lies beside), check.

    ``robot`` chooses the rows of one robot where a ``robot`` column names several. ``more``: files whose trials come after those
    of ``path``, under their file's name. DataError if a file cannot be used.
    """
    path = Path(path)
    table = _joined([path, *more])
    digest = _bytes_sha256([path, *more])[:20]
    each = tuple((one.name, _bytes_sha256([one])[:20]) for one in (path, *more)) if more else ()
    return measured_table(table, path, digest, robot, each)


def measured_table(
    table: pd.DataFrame, path: Path, digest: str = "", robot: str | None = None, files: tuple[tuple[str, str], ...] = ()
) -> Measured:
    """Check a table that was read and mapped already. ``path`` names it; ``digest``: by default that of its values.

    ``files``: as `Measured` has them.
    """
    with naming(path):
        table = _kept(_of_one_robot(table, robot))
    if "trial" in table.columns:
        table = table.assign(trial=whole_names(table["trial"]))
    of = str(table["robot"].dropna().iloc[0]) if "robot" in table.columns and table["robot"].notna().any() else ""
    with naming(path):
        tracks, findings = _tracks(table)
    return Measured(path, tracks, tuple(findings), digest or table_sha256(table)[:20], of, table, files)


def _bytes_sha256(paths: Sequence[Path]) -> str:
    """SHA-256 of files one after the other; of a folder (a recording) its files by name."""
    whole = hashlib.sha256()
    for path in paths:
        for file in sorted(p for p in path.iterdir() if p.is_file()) if path.is_dir() else [path]:
            with file.open("rb") as source:
                while part := source.read(1 << 20):
                    whole.update(part)
    return whole.hexdigest()


def table_sha256(table: pd.DataFrame) -> str:
    """SHA-256 (64 digits) of a table's values: the same for the same numbers from .csv, .parquet or memory.

    Columns go in by name in alphabetical order; numbers as 64-bit floats (every NaN and 0 alike), all else as text.
    """
    whole = hashlib.sha256(str(len(table)).encode())
    for name in sorted(map(str, table.columns)):
        values = table[name]
        whole.update(b"\0" + name.encode() + b"\0")
        if pd.api.types.is_numeric_dtype(values):
            numbers = values.to_numpy(dtype=np.float64, na_value=np.nan) + 0.0
            numbers[np.isnan(numbers)] = np.nan
            whole.update(numbers.astype("<f8").tobytes())
        else:
            whole.update(
                "\0".join("" if missing else str(v) for v, missing in zip(values, values.isna(), strict=True)).encode()
            )
    return whole.hexdigest()


def _tracks(table: pd.DataFrame) -> tuple[Tracks, list[Finding]]:
    if are_cycles(table):
        cycles, findings = checked_cycles(table)
        return cycle_tracks(cycles), findings
    if are_joints(table):
        return joint_tracks(table)
    usable, findings = checked(table)
    tracks = tracks_of(usable)
    found = jumps(tracks)
    visits = excursions(tracks, found)
    seen = without_faults(tracks, found)
    return seen, [*_stamp_findings(seen, usable), *findings, *_jump_findings(tracks, usable, lasting(found, visits), visits)]


def _stamp_findings(tracks: Tracks, usable: pd.DataFrame) -> Iterator[Finding]:
    """Stamps that scatter, in words, at the first pose."""
    scatter = stamp_scatter(tracks)
    if scatter is not None:
        row = int(usable.index[usable[list(POSE)].notna().all(axis=1)][0])
        yield Finding(tracks.names[0], row, scatter.in_words)


def _jump_findings(
    tracks: Tracks, usable: pd.DataFrame, found: NDArray[np.bool_], visits: Sequence[tuple[int, int]]
) -> Iterator[Finding]:
    """Jumps that last and those that are taken back, in words; ``usable``: the rows that the tracks were made of."""
    rows = usable.index.to_numpy()[usable[list(POSE)].notna().all(axis=1).to_numpy()]
    for begin, end in visits:
        moved = float(np.hypot(*(tracks.pose[begin] - tracks.pose[begin - 1])[:2]))
        lost = "pose in between counts" if end - begin == 1 else f"{end - begin} poses in between count"
        text = (
            f"the tracked pose jumps away by {1e3 * moved:.0f} mm at {tracks.own_s[begin]:.2f} s and comes back at "
            f"{tracks.own_s[end]:.2f} s; the {lost} as lost"
        )
        yield Finding(tracks.names[tracks.trial[begin]], int(rows[begin]), text)
    for frame in np.flatnonzero(found):
        moved = float(np.hypot(*(tracks.pose[frame] - tracks.pose[frame - 1])[:2]))
        trial = tracks.names[tracks.trial[frame]]
        if tracks.relative:
            text = f"the sensor's motion of {1e3 * moved:.0f} mm is impossible for a drive; it is excluded"
            yield Finding(trial, int(rows[frame]), text)
            continue
        text = (
            f"the tracked pose jumps by {1e3 * moved:.0f} mm at {tracks.own_s[frame]:.2f} s and stays there: another marker was "
            "mistaken for the robot's, or somebody moved it; later poses of this trial are not used"
        )
        yield Finding(trial, int(rows[frame]), text)


def _joined(paths: Sequence[Path]) -> pd.DataFrame:
    tables = [_mapped(path) for path in paths]
    if len(tables) == 1:
        return tables[0]
    _check_different(paths, tables)
    for number, (path, table) in enumerate(zip(paths, tables, strict=True)):
        if "trial" in table.columns:
            before = f"{number}-{path.stem}: " if number else ""
            names = whole_names(table["trial"])
            table["trial"] = (before + names.astype(str)).where(names.notna())
    return pd.concat(tables, ignore_index=True)


def _check_different(paths: Sequence[Path], tables: Sequence[pd.DataFrame]) -> None:
    """DataError if a trial of one file is one of another, row for row: counted twice it would make all intervals too narrow."""
    shared = sorted(set.intersection(*(set(map(str, table.columns)) for table in tables)) - {"trial"})
    known: dict[bytes, tuple[Path, str]] = {}
    for path, table in zip(paths, tables, strict=True):
        if "trial" not in table.columns or not shared:
            continue
        hashes = pd.util.hash_pandas_object(table[shared], index=False).to_numpy()
        here = {}
        for name, rows in table.groupby("trial", sort=False).indices.items():
            key = hashlib.sha256(hashes[rows].tobytes()).digest()
            if key in known and len(rows) > 1:
                other, same = known[key]
                raise DataError(
                    f"{path}: trial {name} is trial {same} of {other}, row for row. The same drive must not count twice: "
                    "leave the file or the trial out."
                )
            here[key] = (path, str(name))
        known |= here


def _mapped(path: Path) -> pd.DataFrame:
    table, mapping = read_table(path), mapping_beside(path)
    with naming(path):
        return table if mapping is None else applied(table, mapping, path.parent, read_table)


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Name the file in the DataError that is met with it, if it does not say yet which it is about."""
    try:
        yield
    except DataError as error:
        said = str(error).replace(OF_A_LOG, f"{path.name}.import.yaml")
        if str(path) in said or said.startswith(BEGINS):
            raise DataError(said) from error
        raise DataError(f"{path}: {said}") from error


def _kept(table: pd.DataFrame) -> pd.DataFrame:
    """Without the rows of drives that whoever watched them discarded."""
    if DISCARDED not in table.columns:
        return table
    kept = ~(pd.to_numeric(table[DISCARDED], errors="coerce") > 0)
    if not kept.any():
        raise DataError(f"All drives are marked as {DISCARDED}; no measurements are left. Drive again.")
    return table[kept]


def _of_one_robot(table: pd.DataFrame, robot: str | None) -> pd.DataFrame:
    if "robot" not in table.columns:
        if robot is not None:
            raise DataError(
                f"There is no column robot, so {robot!r} cannot be chosen; leave out {in_both('--robot', 'robot=')}, or add the "
                "column."
            )
        return table
    names = sorted(str(name) for name in table["robot"].dropna().unique())
    if robot is None and len(names) > 1:
        raise DataError(
            f"The measurements are of {len(names)} robots: {', '.join(names)}. Choose one with "
            f"{in_both(f'--robot {names[0]}', f'robot={names[0]!r}')}."
        )
    if robot is None:
        return table
    if robot not in names:
        raise DataError(f"The measurements have no robot {robot!r}; they have {', '.join(names)}.")
    return table[table["robot"].astype(str) == robot]
