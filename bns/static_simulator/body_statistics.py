"""Statistics of the snake's random cycles that the dissertation's figures allow to be compared with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bns.engine.philox import Key, Purpose
from bns.physics.snake.parameters import SnakeParameters
from bns.physics.snake_drive import SnakePhysics
from bns.robots.base import Robot
from bns.worlds.many import drive_all

STATISTICS = ("stable_share", "sd_dx_yellow_m", "sd_dx_green_m", "sd_dy_m", "repeat_m")
BOOTSTRAPS = 500
_TO_SD = 1.4826
"""Median of absolute deviations to standard deviation, of normal numbers."""


@dataclass(frozen=True)
class Cycles:
    """What random cycles did: displacements (n, 5), the last whether stable, and those of the first few a second time (m, 5)."""

    moved: np.ndarray
    again: np.ndarray

    def statistics(self) -> np.ndarray:
        """One number for each of `STATISTICS`, SI; infinite where too few cycles were stable to tell."""
        stable = self.moved[self.moved[:, 4] > 0.5, :4]
        once = self.moved[: len(self.again)]
        both = (once[:, 4] > 0.5) & (self.again[:, 4] > 0.5)
        if len(stable) < 2 or not both.any():
            return np.full(len(STATISTICS), np.inf)
        sd = stable.std(axis=0)
        apart = np.abs(once - self.again)[both, :4] / np.sqrt(2)
        # A body that tips one time and not the other would decide on a root mean square.
        repeat = _TO_SD * float(np.median(apart))
        return np.array([len(stable) / len(self.moved), sd[0], sd[2], np.sqrt(np.mean(sd[[1, 3]] ** 2)), repeat])

    def intervals(self, seed: int = 0) -> np.ndarray:
        """95 % bootstrap intervals of `statistics` over cycles, (statistics, 2)."""
        draw, found = np.random.default_rng(seed), []
        for _ in range(BOOTSTRAPS):
            first = draw.integers(0, len(self.again), len(self.again))
            rest = draw.integers(len(self.again), len(self.moved), len(self.moved) - len(self.again))
            found.append(Cycles(self.moved[np.concatenate([first, rest])], self.again[first]).statistics())
        return np.quantile(found, [0.025, 0.975], axis=0).T


def driven(robot: Robot, parameters: SnakeParameters, cycles: int, repeated: int, seed: int, jobs: int = 1) -> Cycles:
    """Random cycles of a body, each driven by itself: the same cycles and draws for every body with the same seed."""
    key, world = Key.of_run(seed, 0, robot.name, "calibrate"), SnakePhysics(parameters)
    commands = robot.random_controllers(key, cycles, 1).commands[:, 0]
    alone = [commands[i : i + 1] for i in [*range(cycles), *range(repeated)]]
    seen = drive_all(world, alone, key, Purpose.PRECOMPUTE, 1, jobs)
    moved = np.array([robot.measured_displacements(poses)[0] for poses in seen])
    return Cycles(moved[:cycles], moved[cycles:])
