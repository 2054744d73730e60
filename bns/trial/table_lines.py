"""Lines of a table of measurements, compared with the journal that it was made from."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Mapping, Sequence
from itertools import count
from pathlib import Path

_SET_LATER = {b"discarded": 1.0, b"stable": 0.0}
"""What the journal may have come to say of a row only after the table was made."""
_SHOWN = 5

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


def edits(lines: Sequence[bytes], made: Sequence[bytes]) -> str:
    """What of a table is not in the one that its journal makes, in words; "" if all of it is.

    ``lines`` and ``made``: their lines, names first. The rows of the first are moments of the second (`rows_before_odd`), and
    ``made`` may have more rows. A column is known by its name; numbers count as the same up to a millionth.
    """
    names, known = ([name.strip() for name in table[0].split(b",")] for table in (lines, made))
    found: dict[int, list[bytes]] = {}
    trials: dict[int, None] = {}
    for number, (line, other) in enumerate(zip(lines[1:], made[1:], strict=False), 2):
        here = dict(zip(names, _numbers(line) or (), strict=True))
        if changed := list(_changed(here, dict(zip(known, _numbers(other) or (), strict=True)))):
            found[number] = changed
            trials[int(here[b"trial"])] = None
    if not found:
        return ""
    columns = dict.fromkeys(name.decode(errors="replace") for changed in found.values() for name in changed)
    return f"{_listed('line', found)} ({_listed('trial', trials)}): {', '.join(columns)}"


def old_tables(table: Path) -> list[Path]:
    """The files to which a table was moved or copied, in order."""
    return [name for name in _old_names(table, sum(1 for _ in table.parent.iterdir())) if name.exists()]


def moving_away(table: Path) -> str:
    """A shell command that moves a file to a name beside it that is free."""
    return f"mv {shlex.quote(str(table))} {shlex.quote(str(free_name(table)))}"


def free_name(table: Path) -> Path:
    """A name beside a table, for it to be moved or copied to, that no file has."""
    return next(name for name in _old_names(table) if not name.exists())


def _old_names(table: Path, most: int | None = None) -> Iterator[Path]:
    for number in count(1) if most is None else range(1, most + 1):
        yield table.with_suffix(f".old{number if number > 1 else ''}{table.suffix}")


def _changed(here: Mapping[bytes, float], made: Mapping[bytes, float]) -> Iterator[bytes]:
    """Names of the cells of a row that say something else than the journal, or what it does not say."""
    for name, value in here.items():
        expected = made.get(name, math.nan)
        if (math.isnan(value) and math.isnan(expected)) or math.isclose(value, expected, rel_tol=1e-6, abs_tol=1e-6):
            continue
        if name not in _SET_LATER or expected != _SET_LATER[name]:
            yield name


def _listed(what: str, numbers: Sequence[int] | Mapping[int, object]) -> str:
    """``lines 3, 4 and 9``; of many the first ones."""
    shown = [str(number) for number in list(numbers)[:_SHOWN]]
    if len(numbers) > len(shown):
        return f"{len(numbers)} {what}s ({', '.join(shown)}, …)"
    return f"{what}{'s' if len(shown) > 1 else ''} {' and '.join(filter(None, (', '.join(shown[:-1]), shown[-1])))}"


def _numbers(line: bytes) -> list[float] | None:
    """The cells of a row, an empty one as NaN; None if one is no number."""
    try:
        return [float(cell) if cell.strip() else math.nan for cell in line.split(b",")]
    except ValueError:
        return None


def _same(one: Moment, other: Moment) -> bool:
    return one[0] == other[0] and math.isclose(one[1], other[1], abs_tol=1e-6)
