"""Poses that no robot can have reached: how many of a drive's there are, and since when there are only such."""

from __future__ import annotations

import math

import numpy as np

OFF_M = 0.04
"""So far a tracker may be off, and a robot slide, beyond what it can drive: as much as poses may differ from orders."""


OFF_RAD = 0.6
"""Likewise of a heading, beyond what it can turn."""


class Leaps:
    """Each pose is compared with the last one that could be reached, so that a place that leaps and comes back counts once."""

    def __init__(self) -> None:
        self.count = 0
        self._at: tuple[float, np.ndarray, float] | None = None
        self._since_s: float | None = None

    def seen(
        self, t_s: float, place: np.ndarray, fastest_m_s: float, heading_rad: float = 0.0, fastest_rad_s: float = 0.0
    ) -> float:
        """Take in a place (2,), m, of a robot that has been no faster than this; for how long it has been out of reach, s.

        A place that leaps is in reach when the robot could have driven there meanwhile; likewise a heading, whole turns aside.
        """
        if self._at is None or t_s <= self._at[0]:
            self._at = (t_s, place, heading_rad) if self._at is None else self._at
            return 0.0
        before_s, before, before_rad = self._at
        lasted_s, turned_rad = t_s - before_s, abs(math.remainder(heading_rad - before_rad, 2.0 * math.pi))
        far = float(np.hypot(*(place - before))) > OFF_M + fastest_m_s * lasted_s
        if not far and turned_rad <= OFF_RAD + fastest_rad_s * lasted_s:
            self._at, self._since_s = (t_s, place, heading_rad), None
            return 0.0
        self.count += 1
        self._since_s = t_s if self._since_s is None else self._since_s
        return t_s - self._since_s
