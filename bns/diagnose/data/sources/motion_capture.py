"""Exports of motion capture as tables: CSV files of OptiTrack Motive and of Vicon Tracker or Nexus.

Both begin with lines that say what the file is, and spread the names of columns over several rows: a body, a quantity, an axis.
Here a column is called after all of them and its unit, as in ``robot.position.x [m]`` and ``robot.TX [mm]``. Columns of markers
are left out: they hold no heading.
"""

from __future__ import annotations

import csv
import gzip
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain, islice, takewhile
from pathlib import Path
from typing import TextIO, cast

import pandas as pd

from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError

TIME = "time [s]"
_MOTIVE = "Format Version"
_BODIES = ("Objects", "Segments")
_VICON = (*_BODIES, "Joints", "Trajectories", "Model Outputs", "Devices")
"""What the parts of a file of Vicon are called, in the first line of each; the first two hold poses of bodies."""
_LENGTHS = {"meters": "m", "centimeters": "cm", "millimeters": "mm", "inches": "in"}
_MOST_HEAD = DEFAULTS.data.head_lines
_BODY, _FRAME = "Rigid Body", "Frame"
_EMPTY = " ,;\t\r\n"


@dataclass(frozen=True)
class _Layout:
    """Where the numbers of a file are: ``names`` by column, the lines before the first row, and the rows (None: all)."""

    names: dict[int, str]
    skipped: int
    rows: int | None
    separator: str
    rate_hz: float | None = None


def is_motion_capture(path: Path) -> bool:
    """Whether the file begins as Motive or Vicon begin theirs."""
    with opened_text(path) as file:
        first = file.readline(len(_MOTIVE) + len(max(_VICON, key=len))).strip()  # a file of another kind may be one long line
    return first.startswith(_MOTIVE) or first.strip(_EMPTY) in _VICON


def read_motion_capture(path: Path) -> pd.DataFrame:
    """One row a frame: the time, then poses of each body as exported. Lost frames are NaN.

    DataError if the file has no body, no time, or names its columns otherwise.
    """
    with opened_text(path) as file:
        lines = iter(file)
        head = list(islice(lines, _MOST_HEAD))
        layout = _motive(path, head) if head[0].startswith(_MOTIVE) else _vicon(path, chain(head, lines))
    table = pd.read_csv(
        path,
        sep=layout.separator,
        header=None,
        skiprows=layout.skipped,
        nrows=layout.rows,
        usecols=sorted(layout.names),
        skip_blank_lines=False,
        encoding="utf-8-sig",
    )
    table.columns = pd.Index([layout.names[at] for at in sorted(layout.names)])
    if layout.rate_hz is not None:
        table.insert(0, TIME, table.pop(_FRAME) / layout.rate_hz)
    return table


@contextmanager
def opened_text(path: Path) -> Iterator[TextIO]:
    """A file of text, packed or not, without its byte order mark."""
    opened = gzip.open if path.suffix == ".gz" else open
    with opened(path, "rt", encoding="utf-8-sig", errors="replace") as file:
        yield cast(TextIO, file)


def cells_of(line: str, separator: str = ",") -> list[str]:
    """The cells of a line."""
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]


def _named_row(path: Path, rows: Sequence[list[str]]) -> int:
    """Which of the first lines begins with Frame; DataError if none."""
    found = next((number for number, row in enumerate(rows) if row and row[0].lower() == "frame"), None)
    if found is None:
        raise DataError(
            f"{path} begins as an export of motion capture, and none of its first {_MOST_HEAD} lines begins with Frame. "
            "Export it again with its header, as comma-separated values."
        )
    return found


def _motive(path: Path, head: Sequence[str]) -> _Layout:
    """Rows of the kind of thing, of its name, of an identifier (of a parent), of the quantity, and of the axis, in this order."""
    rows = [cells_of(line) for line in head]
    said = dict(zip(rows[0][::2], rows[0][1::2], strict=False))
    at = _named_row(path, rows)
    above = [row for row in rows[1:at] if any(row)]
    if len(above) < 3:  # kind, name, quantity
        raise DataError(f"{path} does not say what its columns are of. Export it again from Motive with its header.")
    kinds, names, quantities, axes = above[0], above[1], above[-1], rows[at]
    length = said.get("Length Units", "Meters")
    if length.lower() not in _LENGTHS:
        allowed = ", ".join(map(str.capitalize, _LENGTHS))
        raise DataError(f"{path} is in {length}; allowed are {allowed}. Export it again in meters.")
    angle = "" if said.get("Rotation Type", "Quaternion") == "Quaternion" else " [deg]"
    units = {"position": f" [{_LENGTHS[length.lower()]}]", "rotation": angle}
    found = {
        number: f"{name}.{quantity.lower()}.{axis.lower()}{units[quantity.lower()]}"
        for number, (kind, name, quantity, axis) in enumerate(zip(kinds, names, quantities, axes, strict=False))
        if kind == _BODY and quantity.lower() in units
    }
    if not found:
        raise DataError(
            f"{path} holds no rigid body, and the heading of a robot needs one. Define it in Motive, and export it with "
            "Rigid Bodies on."
        )
    times = [number for number, axis in enumerate(axes) if axis.lower().startswith("time") and axis.lower() != "timecode"]
    if not times:
        raise DataError(f"{path} has no column of times. Export it again from Motive with its header.")
    return _Layout({times[0]: TIME, **found}, at + 1, None, ",")


def _vicon(path: Path, lines: Iterator[str]) -> _Layout:
    """Of the part that holds bodies: the rate, names of bodies, names of columns, their units; then rows until an empty line."""
    before, kinds = 1, list[str]()
    for line in lines:
        kind = line.strip(_EMPTY)
        if kind in _BODIES:
            break
        kinds += [kind] if kind in _VICON else []
        before += 1
    else:
        raise DataError(
            f"{path} holds {', '.join(kinds)} alone, and the heading of a robot needs a body. Define an object in Vicon, and "
            "export it."
        )
    head = list(islice(lines, _MOST_HEAD))
    separator = max(",;\t", key="".join(head).count)
    rows = [cells_of(line, separator) for line in head]
    at = _named_row(path, rows)
    rate = number_of(rows[0][0] if rows[0] else "")
    if at < 2 or len(rows) < at + 2 or not rate > 0:
        raise DataError(f"{path} lacks the names of its bodies, the units of its columns or its frame rate. Export it again.")
    named = enumerate(zip(_carried(rows[at - 1], len(rows[at])), rows[at], rows[at + 1], strict=False))
    found = {n: f"{body}.{axis} [{unit}]" if unit else f"{body}.{axis}" for n, (body, axis, unit) in named if body and axis}
    if not found:
        raise DataError(f"{path} names no body above its columns. Export the object of the robot from Vicon.")
    rows_of_it = sum(1 for _ in takewhile(lambda line: line.strip(_EMPTY), chain(head[at + 2 :], lines)))
    return _Layout({0: _FRAME, **found}, before + at + 2, rows_of_it, separator, rate)


def number_of(text: str) -> float:
    """NaN where it is none."""
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _carried(row: Sequence[str], count: int) -> list[str]:
    """Names for so many columns: each stands above the first of its own; ``robot:robot`` is called robot."""
    names, now = [], ""
    for cell in [*row, *[""] * (count - len(row))]:
        parts = cell.split(":")
        now = (parts[0] if len(set(parts)) == 1 else cell) or now
        names.append(now)
    return names
