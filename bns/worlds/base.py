"""What the loop asks of a world."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from bns.engine.philox import Key, Purpose


class World(Protocol):
    """Answers a controller with what the robot did."""

    digest: str
    """Changes whenever the world would answer otherwise; stored with every run."""

    repeatable: bool
    """Whether it answers whatever is asked of it, as often as wanted; a robot only drives what was picked."""

    def drive(self, commands: np.ndarray, key: Key, purpose: Purpose, step: int) -> np.ndarray:
        """Measured poses (n, 3) at the end of each command (n, components); draws come from key, purpose and step."""
