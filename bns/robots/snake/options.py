"""What can be switched on by the snake's name: what goes beyond the dissertation, and other ways to read it (docs/choices.md)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bns.robots.snake.path import START_M, YELLOW_ON_ORIGIN_M

BEYOND = ("changes", "rigid")
"""What the simulator can do beyond the dissertation."""
READINGS = (
    "crossover-80",
    "cut-without-noise",
    "flat-spot",
    "nguyen-widrow",
    "noise-8cm",
    "sorted-amplitudes",
    "yellow-on-origin",
)
"""Readings of the dissertation that are not the default."""
FLAT_SPOT = 0.1
"""What the original's library adds to the slope of every sigmoid while it trains."""
_HALF, _MOST = 0.5, 0.8


@dataclass(frozen=True)
class Options:
    """One snake's choice among `BEYOND` and `READINGS`, as numbers."""

    names: tuple[str, ...] = ()

    def __contains__(self, name: str) -> bool:
        return name in self.names

    @property
    def parent_share(self) -> float:
        """Share of a child's components that come from the first parent: a half (5.6), or 80 % (5.4.2, pre-computed work)."""
        return _MOST if "crossover-80" in self else _HALF

    @property
    def flat_spot(self) -> float:
        """Added to the slope of a sigmoid in training."""
        return FLAT_SPOT if "flat-spot" in self else 0.0

    @property
    def start_m(self) -> np.ndarray:
        """Yellow and green (2, 2) at the start: the middle on (30, 0), or yellow on the origin (section 5.3.3 has both)."""
        return np.array(YELLOW_ON_ORIGIN_M if "yellow-on-origin" in self else START_M)

    @property
    def noise_sd_m(self) -> float | None:
        """Standard deviation of the substitute world where it is not the one that its file says: 8 cm (section 5.8)."""
        return 0.08 if "noise-8cm" in self else None
