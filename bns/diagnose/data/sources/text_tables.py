"""Tables written as text: separated by commas, semicolons, tabs or blanks, with or without ``#`` before their heading."""

from __future__ import annotations

import gzip
import re
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

import pandas as pd

from bns.diagnose.data.sources.motion_capture import is_motion_capture, read_motion_capture
from bns.diagnose.data.sources.qualisys import is_qualisys, read_qualisys
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.measurements import COLUMNS

MOST_COLUMNS = DEFAULTS.data.most_columns
_LONGEST_LINE = DEFAULTS.data.longest_line
_HEAD_LINES = DEFAULTS.data.head_lines
ENDINGS = (".csv", ".csv.gz", ".tsv", ".dat", ".txt")
_COMMENT = ("#", "%")
_WITH_UNIT = re.compile(r"[^\s\[\(]+(?:\s*[\[\(][^\]\)]*[\]\)])?")
_CUTS: tuple[Callable[[str], list[str]], ...] = (
    lambda line: line.split("\t"),
    lambda line: re.split(r"[,;]", line),
    lambda line: re.split(r"\s{2,}|\t", line),
    _WITH_UNIT.findall,
    str.split,
)
"""Ways to cut a heading behind ``#`` into names, the surest first: `# Time [s]   x [m]` is two names, not four."""


def read_text_table(path: Path) -> pd.DataFrame:
    """The table; DataError where it has more columns than a log of a robot has.

    Lines that begin with ``#`` or ``%`` are comments; the last one before the numbers that has as many names as there are
    columns is the heading. Without one, and with numbers in the first line, columns are column_1, column_2, ...
    """
    if is_motion_capture(path):
        return read_motion_capture(path)
    if is_qualisys(path):
        return read_qualisys(path)
    comments, first, second = _head(path)
    separator = _separator(first, path)
    decimal = _decimal(separator, second or first)
    count = len(_cells(first, separator))
    names = (
        None
        if separator == "," and not comments and path.name.endswith((".csv", ".csv.gz"))
        else _names(comments, count)
    )
    numbers = _all_numbers(_cells(first, separator), decimal)
    if names is None and numbers and not path.name.endswith((".csv", ".csv.gz")):
        names = [f"column_{number + 1}" for number in range(count)]
    table = pd.read_csv(
        path,
        sep=r"\s+" if separator == " " else separator,
        decimal=decimal,
        comment=comments[0][0] if comments else None,
        header=None if names and numbers else 0,
        skipinitialspace=bool(comments),
    )
    if names and numbers:
        table.columns = pd.Index(names)
        return table
    table.columns = pd.Index([str(name).strip() for name in table.columns])
    given = [cell.strip('"').strip() for cell in _cells(first, separator)]
    twice = sorted({name for name in given if name in COLUMNS and given.count(name) > 1})
    if twice:  # pandas would call the second x_m.1, and nobody would read it
        raise DataError(f"{path} has more than one column {', '.join(twice)}; leave out all but one of that name.")
    return table


def _head(path: Path) -> tuple[list[str], str, str]:
    """Comment lines before the first row, the first line that is none, and the one after it."""
    opened = gzip.open if path.suffix == ".gz" else open
    comments: list[str] = []
    with opened(path, "rt", encoding="utf-8-sig", errors="replace") as lines:
        for line in _lines(lines):
            if line.startswith(_COMMENT):
                comments.append(line)
            elif line.strip():
                return comments, line.rstrip("\r\n"), next(_lines(lines), "").rstrip("\r\n")
            if len(comments) > _HEAD_LINES:
                raise DataError(f"{path} begins with more than {_HEAD_LINES} lines of comments; shorten them.")
    return comments, "", ""


def _lines(file: object) -> Iterator[str]:
    while line := file.readline(_LONGEST_LINE):  # type: ignore[attr-defined]
        yield line


def _separator(line: str, path: Path) -> str:
    """What stands between the columns of a line."""
    found = max(",;\t", key=line.count)
    if line.count(found) >= MOST_COLUMNS or len(line) >= _LONGEST_LINE - 1:
        raise DataError(
            f"{path} has {line.count(found) + 1} columns or more, by its first line; {MOST_COLUMNS} are allowed. "
            "Keep those that the diagnosis needs (docs/logs.md)."
        )
    if found not in line and path.name.endswith((".csv", ".csv.gz")):
        return ","
    return found if found in line else " "


def _cells(line: str, separator: str) -> list[str]:
    return line.split() if separator == " " else [cell.strip() for cell in line.split(separator)]


def _decimal(separator: str, line: str) -> str:
    return "," if separator != "," and "," in line and "." not in line else "."


def _all_numbers(cells: list[str], decimal: str) -> bool:
    return all(_is_number(cell.replace(decimal, ".")) for cell in cells if cell)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _names(comments: list[str], count: int) -> list[str] | None:
    """Names of so many columns from the last comment that has them."""
    for line in reversed(list(islice(comments, _HEAD_LINES))):
        text = line.lstrip("#% \t").rstrip()
        for cut in _CUTS:
            names = [name.strip().strip('"') for name in cut(text) if name.strip()]
            if len(names) == count == len(set(names)) and not _all_numbers(names, "."):
                return names
    return None
