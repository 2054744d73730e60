"""Lines of a table of measurements, compared with the journal that it was made from."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from itertools import count
from pathlib import Path

Moment = tuple[float, float]
"""The drive that a row is of, and its time: `trial` and `t_s`."""


def rows_before_odd(lines: Sequence[bytes], known: Sequence[Moment]) -> int:
    """How many rows (lines below the first) stand above the first line that cannot be of the table; -1: the first line itself.

    ``known`` are the moments of the journal's rows. The table begins with the same ones, and any further rows go on in order.
    """
    names = [name.strip() for name in lines[0].split(b",")]
    if not {b"trial", b"t_s"} <= set(names):
        return -1
    drive, time = names.index(b"trial"), names.index(b"t_s")
    before = (0.0, 0.0)
    for number, line in enumerate(lines[1:]):
        row = _numbers(line)
        if row is None or len(row) != len(names):
            return number
        here = row[drive], row[time]
        if not (_same(here, known[number]) if number < len(known) else here > before):
            return number
        before = here
    return len(lines) - 1


def moving_away(table: Path) -> str:
    """A shell command that moves a file to a name beside it that is free."""
    names = (table.with_suffix(f".old{number if number > 1 else ''}{table.suffix}") for number in count(1))
    free = next(name for name in names if not name.exists())
    return f"mv {shlex.quote(str(table))} {shlex.quote(str(free))}"


def _numbers(line: bytes) -> list[float] | None:
    """The cells of a row, an empty one as NaN; None if one is no number."""
    try:
        return [float(cell) if cell.strip() else math.nan for cell in line.split(b",")]
    except ValueError:
        return None


def _same(one: Moment, other: Moment) -> bool:
    return one[0] == other[0] and math.isclose(one[1], other[1], abs_tol=1e-6)
