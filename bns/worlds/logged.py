"""Any world, with what it was told and what it answered kept as measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from bns.engine.philox import Key, Purpose
from bns.measurements import write_measurements
from bns.robots.base import Robot
from bns.worlds.base import RenderableWorld, World

if TYPE_CHECKING:  # half a second to load, and a run needs no table
    import pandas as pd


class LoggedWorld:
    """Passes every drive on to ``world``; those that the loop learns from become trials, numbered by evaluation."""

    def __init__(self, world: World, robot: Robot) -> None:
        self._world, self._robot = world, robot
        self._trials: list[pd.DataFrame] = []
        self.digest = world.digest
        self.repeatable, self.renderable = world.repeatable, world.renderable
        self.changes_at = getattr(world, "changes_at", None)

    def drive(self, commands: np.ndarray, key: Key, purpose: Purpose, step: int) -> np.ndarray:
        """As the world it stands before."""
        poses = self._world.drive(commands, key, purpose, step)
        if purpose is Purpose.WORLD_EVALUATED:
            self._trials.append(self._robot.measurements(step, commands[: len(poses)], poses))
        return poses

    def render(self, commands: np.ndarray, picture: Path) -> None:
        """As the world it stands before, which must be renderable; the picture's drive is no trial."""
        cast(RenderableWorld, self._world).render(commands, picture)

    def check_picture(self, picture: Path) -> None:
        """As the world it stands before, which must be renderable."""
        cast(RenderableWorld, self._world).check_picture(picture)

    def write(self, path: Path) -> None:
        """All trials so far, as .csv or .parquet."""
        import pandas as pd  # noqa: PLC0415  # as above

        write_measurements(pd.concat(self._trials, ignore_index=True), path, self._robot.measured_columns)
