"""A mapping that knows its file and the lines of its entries, so that all messages about it begin in one way:
``the mapping LOG.import.yaml, line 4: what was given; what is allowed``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bns.errors import DataError
from bns.safe_yaml import Lines

BEGINS = "the mapping"
OF_A_LOG = "LOG.import.yaml"
"""The mapping of a log, in messages of those who do not know which log it is."""


class LocatedMapping(dict[str, Any]):
    """``path``: of its file, None for one in memory, of which no line is named."""

    def __init__(self, tree: Mapping[str, Any], path: Path | None = None, lines: Lines | None = None) -> None:
        super().__init__(tree)
        self._name, self._lines = BEGINS if path is None else f"{BEGINS} {path}", lines or Lines()

    @contextmanager
    def at(self, *steps: str | int) -> Iterator[None]:
        """Name the file, and the line of the piece that these keys lead to, in a DataError that is met with it."""
        try:
            yield
        except DataError as error:
            text = str(error)
            if text.startswith((BEGINS, "Row ")):  # a row is one of the log
                raise
            line = self._lines.line(*steps)
            raise DataError(f"{self._name}{'' if line is None else f', line {line}'}: {text}") from error


def located(mapping: Mapping[str, Any]) -> LocatedMapping:
    """A mapping as it is, or one in memory."""
    return mapping if isinstance(mapping, LocatedMapping) else LocatedMapping(mapping)
