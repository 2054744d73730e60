"""Other readings of the dissertation that the Khepera's name switches on (docs/choices.md)."""

from __future__ import annotations

from dataclasses import dataclass

from bns.engine.breeding import DEFAULT, Operators
from bns.robots.khepera.rules import MISSED_GOAL_M

PENALTIES_M = {"penalty-1m": 1.0, "penalty-3m": 3.0}
READINGS = ("cuts-inside", "exact-durations", "flat-spot", "one-component", *PENALTIES_M)
"""Readings that are not the default."""
FLAT_SPOT = 0.1
"""What the original's library adds to the slope of every sigmoid while it trains."""


@dataclass(frozen=True)
class Options:
    """One Khepera's choice among `READINGS`, as what the engine takes."""

    names: tuple[str, ...] = ()

    @property
    def operators(self) -> Operators:
        """Crossover and mutation: durations by exactly 400 ms ("-400 or 400 ms", section 4.3), one component a command."""
        return DEFAULT._replace(
            exact=(False, False, "exact-durations" in self.names),
            one_component="one-component" in self.names,
            cuts_inside="cuts-inside" in self.names,
        )

    @property
    def flat_spot(self) -> float:
        """Added to the slope of a sigmoid in training."""
        return FLAT_SPOT if "flat-spot" in self.names else 0.0

    @property
    def penalty_m(self) -> float:
        """Of a goal missed; of two penalties the smaller counts."""
        return min((PENALTIES_M[name] for name in self.names if name in PENALTIES_M), default=MISSED_GOAL_M)
