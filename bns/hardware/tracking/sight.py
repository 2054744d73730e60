"""What a tracker gives: a pose with the time it was seen at, or nothing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np


@dataclass(frozen=True)
class Sight:
    """A pose (3,): x_m, y_m, heading_rad, when it was seen, how well the markers fit (RMS, m), and where each is (2,), m."""

    t_s: float
    pose: np.ndarray
    residual_m: float = 0.0
    points: Mapping[str, np.ndarray] = field(default_factory=dict)


class Tracker(Protocol):
    """Looks at the robot. An old picture is never given as a new one."""

    def look(self) -> Sight | None:
        """The newest sight; None if the robot is not seen, or nothing new has come since the last look but one."""

    def close(self) -> None:
        """Give the device free."""


def unwrapped(heading_rad: float, near_rad: float) -> float:
    """The heading plus whole turns that comes nearest to `near_rad`: robots turn less than half a turn between two looks."""
    return heading_rad + 2.0 * math.pi * round((near_rad - heading_rad) / (2.0 * math.pi))
