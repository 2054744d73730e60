"""Measurements from a file, as checked tracks."""

from __future__ import annotations

import gzip
import hashlib
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from pyarrow import ArrowException

from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.checks import Finding, checked
from bns.diagnose.data.cycles import are_cycles, checked_cycles, cycle_tracks
from bns.diagnose.data.joints import are_joints, joint_tracks
from bns.diagnose.data.mapping import mapping_beside
from bns.diagnose.data.relative_motions import read_json_lines
from bns.diagnose.data.tracker_faults import jumps, without_faults
from bns.diagnose.data.tracks import Tracks, tracks_of
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.measurements import POSE

MOST_COLUMNS = DEFAULTS.data.most_columns
_LONGEST_LINE = DEFAULTS.data.longest_line


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


def load_measured(path: str | Path, robot: str | None = None, more: Sequence[Path] = ()) -> Measured:
    """Read, map (if ``DATA.import.yaml`` lies beside), check.

    ``robot`` chooses the rows of one robot where a ``robot`` column names several. ``more``: files whose trials come after those
    of ``path``, under their file's name. DataError if a file cannot be used.
    """
    path = Path(path)
    table = _joined([path, *more])
    digest = hashlib.sha256(b"".join(p.read_bytes() for p in (path, *more))).hexdigest()[:20]
    return measured_table(table, path, digest, robot)


def measured_table(table: pd.DataFrame, path: Path, digest: str = "", robot: str | None = None) -> Measured:
    """Check a table that was read and mapped already. ``path`` names it; ``digest``: by default that of its values."""
    with naming(path):
        table = _of_one_robot(table, robot)
    of = str(table["robot"].dropna().iloc[0]) if "robot" in table.columns and table["robot"].notna().any() else ""
    with naming(path):
        tracks, findings = _tracks(table)
    return Measured(path, tracks, tuple(findings), digest or table_sha256(table)[:20], of, table)


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
    return without_faults(tracks), [*findings, *_jump_findings(tracks, usable)]


def _jump_findings(tracks: Tracks, usable: pd.DataFrame) -> Iterator[Finding]:
    """A jump that lasts, in words; ``usable``: the rows that the tracks were made of."""
    rows = np.flatnonzero(usable[list(POSE)].notna().all(axis=1))
    for frame in np.flatnonzero(jumps(tracks)):
        moved = float(np.hypot(*(tracks.pose[frame] - tracks.pose[frame - 1])[:2]))
        trial = tracks.names[tracks.trial[frame]]
        if tracks.relative:
            text = f"the sensor's motion, {1e3 * moved:.0f} mm, is one that no drive leads to: it is left out"
            yield Finding(trial, int(rows[frame]), text)
            continue
        text = (
            f"the tracked pose jumps by {1e3 * moved:.0f} mm at {tracks.t_s[frame]:.2f} s and stays there: another marker was "
            "taken for the robot's, or somebody moved it; nothing is judged by the poses that follow in this trial"
        )
        yield Finding(trial, int(rows[frame]), text)


def read_table(path: Path) -> pd.DataFrame:
    """A .csv (or .csv.gz) or .parquet file as it is; DataError if there is none or it does not read."""
    if not path.is_file():
        raise DataError(f"There is no file {path}. Give a .csv or .parquet file of measurements.")
    try:
        if path.name.endswith((".csv", ".csv.gz")):
            separator, decimal = _written(path)
            return pd.read_csv(path, sep=separator, decimal=decimal)
        if path.suffix == ".tuple":
            return read_json_lines(path)
        if path.suffix == ".parquet":
            return pd.read_parquet(path)
    except (ValueError, OSError, EOFError, zlib.error, OverflowError, KeyError, ArrowException, yaml.YAMLError) as fault:
        raise DataError(f"{path} does not read as {path.suffix[1:]}: {fault}.") from fault
    raise DataError(f"{path} is no .csv or .parquet file; measurements come as one of these.")


def _written(path: Path) -> tuple[str, str]:
    """What separates a .csv's columns, and its decimals, by its first two lines: many spreadsheets write 1,5;2,5."""
    opened = gzip.open if path.suffix == ".gz" else open
    with opened(path, "rt", encoding="utf-8", errors="replace") as lines:
        head, first = lines.readline(_LONGEST_LINE), lines.readline(_LONGEST_LINE)
    separator = max(",;\t", key=head.count)
    if head.count(separator) >= MOST_COLUMNS or len(head) >= _LONGEST_LINE:
        raise DataError(
            f"{path} has {head.count(separator) + 1} columns or more, by its first line; {MOST_COLUMNS} are allowed. "
            "Keep those that the diagnosis needs (docs/logs.md)."
        )
    return separator, "," if separator != "," and "," in first and "." not in first else "."


def _joined(paths: Sequence[Path]) -> pd.DataFrame:
    tables = [_mapped(path) for path in paths]
    if len(tables) == 1:
        return tables[0]
    for number, (path, table) in enumerate(zip(paths, tables, strict=True)):
        if "trial" in table.columns:
            before = f"{number}-{path.stem}: " if number else ""
            table["trial"] = before + table["trial"].astype(str)
    return pd.concat(tables, ignore_index=True)


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
        if str(path) in str(error):
            raise
        raise DataError(f"{path}: {error}") from error


def _of_one_robot(table: pd.DataFrame, robot: str | None) -> pd.DataFrame:
    if "robot" not in table.columns:
        if robot is not None:
            raise DataError(f"There is no column robot to choose {robot!r} by; leave out --robot, or name the robot of each row.")
        return table
    names = sorted(str(name) for name in table["robot"].dropna().unique())
    if robot is None and len(names) > 1:
        raise DataError(
            f"The measurements are of {len(names)} robots: {', '.join(names)}. Choose one with --robot {names[0]}."
        )
    if robot is None:
        return table
    if robot not in names:
        raise DataError(f"The measurements have no robot {robot!r}; they have {', '.join(names)}.")
    return table[table["robot"].astype(str) == robot]
