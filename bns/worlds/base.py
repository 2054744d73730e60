"""What the loop asks of a world."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np

from bns.engine.philox import Key, Purpose


class World(Protocol):
    """Answers a controller with what the robot did."""

    digest: str
    """Changes whenever the world would answer otherwise; stored with every run."""
    repeatable: bool = True
    """Can the same commands be driven again, for measurement alone? Not where a robot drives."""
    renderable: bool = False
    """Is it a `RenderableWorld`?"""

    def drive(self, commands: np.ndarray, key: Key, purpose: Purpose, step: int) -> np.ndarray:
        """Measured poses (m, columns) of commands (n, components); m < n where the drive had to end."""


class RenderableWorld(World, Protocol):
    """A world with a picture of its robot."""

    def render(self, commands: np.ndarray, picture: Path) -> None:
        """Drive these commands (n, components) once more and write a picture or film."""

    def check_picture(self, picture: Path) -> None:
        """ModelError for a file that `render` cannot write."""
