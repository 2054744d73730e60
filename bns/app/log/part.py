"""What of a log takes part: trials, findings and ends of trials that the user left out; as it is saved, and as Python."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bns.api.measurements import Measurements
from bns.errors import DataError

KEYS = ("left_out", "findings", "cuts")
"""Of a session file."""


@dataclass(frozen=True)
class Part:
    """``trials``: names of those left out; ``findings``: rows of what is left out with all around it; ``cuts``: trial, from, to
    (s) of what is kept of it."""

    trials: tuple[str, ...] = ()
    findings: tuple[int, ...] = ()
    cuts: tuple[tuple[str, float, float], ...] = ()

    def __bool__(self) -> bool:
        """Is anything left out?"""
        return bool(self.trials or self.findings or self.cuts)

    def of(self, log: Measurements) -> Measurements:
        """The measurements that take part. DataError if none are left, or there are no such trials or rows."""
        whole = log.without_rows(log.rows_around(*self.findings)) if self.findings else log
        return whole.cut({name: (a, b) for name, a, b in self.cuts}).without(self.trials)

    def python(self) -> list[str]:
        """Lines that do the same to a ``log``."""
        lines = []
        if self.findings:
            lines.append(f"log = log.without_rows(log.rows_around({', '.join(map(str, self.findings))}))")
        if self.cuts:
            kept = ", ".join(f"{name!r}: ({a!r}, {b!r})" for name, a, b in self.cuts)
            lines.append(f"log = log.cut({{{kept}}})")
        return [*lines, f"log = log.without({list(self.trials)!r})"] if self.trials else lines

    def plain(self) -> dict[str, Any]:
        """For a session file."""
        cuts = [{"trial": name, "from_s": a, "to_s": b} for name, a, b in self.cuts]
        return {"left_out": list(self.trials), "findings": list(self.findings), "cuts": cuts}


ALL = Part()
"""Nothing is left out."""


def read_part(tree: Mapping[str, Any], where: str) -> Part:
    """What a session file says; DataError where it says something else."""
    try:
        cuts = tuple((str(c["trial"]), float(c["from_s"]), float(c["to_s"])) for c in tree.get("cuts") or ())
        return Part(tuple(map(str, tree.get("left_out") or ())), tuple(map(int, tree.get("findings") or ())), cuts)
    except (KeyError, TypeError, ValueError) as fault:
        raise DataError(
            f"{where}: left_out lists trials, findings lists rows, cuts lists {{trial, from_s, to_s}}; given: "
            f"{ {key: tree.get(key) for key in KEYS} }."
        ) from fault
