"""Any world, with what it was told and what it answered kept as measurements."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bns.engine.philox import Key, Purpose
from bns.errors import SpecError
from bns.measurements import trial_table, write_measurements
from bns.robots.base import Robot
from bns.worlds.base import World


class LoggedWorld:
    """Passes every drive on to ``world``; those that the loop learns from become trials, numbered by evaluation.

    SpecError if the robot has no wheels whose speeds the table could hold.
    """

    def __init__(self, world: World, robot: Robot) -> None:
        self._speeds: Any = getattr(robot, "wheel_speeds_m_s", None)
        if self._speeds is None:
            raise SpecError(
                f"The table of measurements holds wheel speeds, and {robot.name} has no wheels; leave --measurements out."
            )
        self._world, self._start = world, robot.start_pose()
        self._trials: list[pd.DataFrame] = []
        self.digest = world.digest
        self.repeatable = getattr(world, "repeatable", True)

    def drive(self, commands: np.ndarray, key: Key, purpose: Purpose, step: int) -> np.ndarray:
        """As the world it stands before."""
        poses = self._world.drive(commands, key, purpose, step)
        if purpose is Purpose.WORLD_EVALUATED:
            told = np.column_stack(self._speeds(commands[: len(poses)].astype(np.float64)))
            self._trials.append(trial_table(step, told, np.vstack([self._start, poses])))
        return poses

    def write(self, path: Path) -> None:
        """All trials so far, as .csv or .parquet."""
        write_measurements(pd.concat(self._trials, ignore_index=True), path)
