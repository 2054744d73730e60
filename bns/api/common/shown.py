"""How results show themselves: one line, a text, a notebook's cell."""

from __future__ import annotations

import html
from abc import ABC, abstractmethod
from typing import Any

LONGEST_LINE = 200


class Shown(ABC):
    """A result: `repr` is one line of at most 200 characters, `summary` the text that the command line prints."""

    @abstractmethod
    def summary(self) -> str:
        """The result as text, several lines."""

    @abstractmethod
    def _line(self) -> str:
        """The most important facts, after the class's name."""

    def __repr__(self) -> str:
        line = " ".join(f"<{type(self).__name__}: {self._line()}>".split())
        return line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 2]}…>"

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        return f"<b>{html.escape(self._line())}</b><pre>{html.escape(self.summary())}</pre>"


def counted(number: int, what: str) -> str:
    """``1 trial``, ``2 trials``."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def plain(value: Any) -> Any:
    """Values as JSON and YAML know them: numpy's numbers and arrays, tuples and ranges become Python's numbers and lists."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, dict):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple | range):
        return [plain(each) for each in value]
    return value
