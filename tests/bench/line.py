"""One line of the table: what was measured, what was wanted, and how far the floor is."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Line:
    """`measured` and `target` share a unit; at_most says on which side of the target it should be.

    Without a target a line informs, and is neither met nor missed. `floor` is the least (or, for a ratio that should
    be large, the most) that the machine allows, in the same unit.
    """

    name: str
    measured: float | None
    target: float | None
    unit: str
    at_most: bool
    floor: float | None = None
    note: str = ""

    @property
    def met(self) -> bool | None:
        """None where nothing was measured, or nothing was wanted."""
        if self.measured is None or self.target is None:
            return None
        return bool(self.measured <= self.target if self.at_most else self.measured >= self.target)

    @property
    def distance(self) -> float | None:
        """How many times the floor, or which share of the ceiling, this is."""
        return float(self.measured / self.floor) if self.measured is not None and self.floor else None

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self) | {"met": self.met, "distance": self.distance}

    def in_words(self) -> str:
        """One row of the table."""
        wanted = "no target" if self.target is None else f"{'<=' if self.at_most else '>='} {self.target:<5g}"
        verdict = {True: "met", False: "NOT met", None: "" if self.target is None else "not measured"}[self.met]
        measured = "-" if self.measured is None else f"{self.measured:.3g}"
        told = "; ".join(part for part in (self._floor_in_words(), self.note) if part)
        return f"{self.name:58s} {measured:>8s} {self.unit:3s} {wanted:9s} {verdict:12s} {told}".rstrip()

    def _floor_in_words(self) -> str:
        if self.floor is None or self.distance is None:
            return ""
        if self.at_most:
            return f"floor {self.floor:.3g} {self.unit}, this is {self.distance:.2g} times that"
        return f"ceiling {self.floor:.3g}, this is {self.distance:.0%} of it"


def at_most(
    name: str, measured: float | None, target: float, unit: str, floor: float | None = None, note: str = ""
) -> Line:
    """A duration or a share: less is better."""
    return Line(name, measured, target, unit, True, floor, note)


def without_target(name: str, measured: float, unit: str, note: str = "") -> Line:
    """To be known, not to be reached."""
    return Line(name, measured, None, unit, True, note=note)


def at_least(name: str, measured: float | None, target: float, floor: float | None = None, note: str = "") -> Line:
    """A ratio: more is better."""
    return Line(name, measured, target, "x", False, floor, note)
