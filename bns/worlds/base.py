"""What the loop asks of a world."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from bns.engine.philox import Key, Purpose


class World(Protocol):
    """Answers a controller with what the robot did."""

    digest: str
    """Changes whenever the world would answer otherwise; stored with every run."""

    def drive(self, commands: np.ndarray, key: Key, purpose: Purpose, step: int) -> np.ndarray:
        """Measured poses (m, columns) of commands (n, components); m < n where the drive had to end."""
