"""The order to stop as the guard gives it: what is written, which answers say that the robot stands. Standard library alone."""

from __future__ import annotations

import re
from typing import Any

_READINGS = 2


class StopOrder:
    """Made of the plain data of a `recipe.StopRecipe`."""

    def __init__(self, stop: dict[str, Any]) -> None:
        self._stop = stop
        self.steps = [(s.encode("latin-1"), r and re.compile(r.encode("latin-1"), re.DOTALL)) for s, r in stop["steps"]]
        self._own_stop = re.compile(stop["own_stop"].encode("latin-1"), re.DOTALL)
        self.quiet_s: float = stop["quiet_s"]
        self.begin()

    def begin(self) -> None:
        """Nothing has been asked yet."""
        self.wait_s: float = self._stop["wait_s"]
        self._good = 0
        self._before: list[int] | None = None

    def is_in(self, data: bytes) -> bool:
        """Whether a driver orders its robot to stop."""
        return self._own_stop.search(data) is not None

    def numbers(self, match: re.Match[bytes]) -> list[int]:
        """Speeds or places in an answer."""
        groups = match.groups()
        return [int(group) if self._stop["text"] else int.from_bytes(group, "little") for group in groups]

    def confirmed(self, values: list[int] | None) -> bool:
        """Take in what a round of questions brought (None: an answer is missing); whether two in a row say that it stands."""
        self._good = self._good + 1 if values is not None and self._stands(values) else 0
        self._before = values
        if values is None:
            self.wait_s = min(2.0 * self.wait_s, self._stop["longest_s"])
        return self._good >= _READINGS

    def _stands(self, values: list[int]) -> bool:
        """Every speed is small, or every place is that of the round before."""
        within = self._stop["within"]
        if self._stop["text"]:
            return all(abs(value) <= within for value in values)
        if self._before is None:
            return False
        return all(abs(a - b) <= within for a, b in zip(values, self._before, strict=True))
