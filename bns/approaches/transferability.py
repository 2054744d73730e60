"""Transferability: the simulator stays, and what is learned is where it can be trusted.

After Koos, Mouret and Doncieux ("The transferability approach: crossing the reality gap in evolutionary robotics", 2013):

1. controllers evolve under two objectives, fitness in simulation and expected transferability, by NSGA-II:
   `advance`, `ParetoEvolver`
2. every so many generations one controller is driven, the one whose behaviour lies furthest from all that were driven: `pick`
3. the gap between its simulated and its real behaviour is measured: `learn`
4. the gap of any controller is interpolated between those measured, by inverse distance weighting: `expected_gap`
5. at the end the fittest of those that are expected to transfer is taken: `fittest`

Silent there, or of other robots, chosen here: the simulator is the robot's drawing; a behaviour is the simulated positions after
a third, two thirds and all of the commands; the gap is the mean distance between simulated and driven positions; candidates for
a drive are those in the first front; "expected to transfer" is a gap of less than option ``tolerated`` of the goals' radius, and
the least gap of all where nobody has that. The paper's third objective, diversity of behaviour, is left to the choice of what is
driven. Every ``every``-th drive is of the fittest, so that what is recorded as evaluated is comparable with other approaches'.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from bns.approaches.parts.base import Option, Options, Setting
from bns.approaches.parts.pareto import ParetoEvolver
from bns.approaches.parts.physical import Physical
from bns.approaches.parts.physics_models import ModelSpace
from bns.bootstrap.simulators import PhysicsSimulator
from bns.robots.base import TwoWheeled

_NEAREST_M = 1e-3
"""Behaviours nearer than this to one that was driven are taken to be it."""


def behaviours(paths: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Positions after a third, two thirds and all of the commands, m (n, 6), of paths (n, longest, 3)."""
    at = np.ceil(np.outer(lengths, (1 / 3, 2 / 3, 1.0)) - 1e-9).astype(np.int64) - 1
    return paths[np.arange(len(paths))[:, None], at, :2].reshape(len(paths), -1)


class TransferArchive:
    """Behaviours (6,) of what was driven, and their gaps, m."""

    def __init__(self) -> None:
        """Nothing was driven."""
        self.behaviours, self.gaps = np.empty((0, 6)), np.empty(0)

    def add(self, behaviour: np.ndarray, gap_m: float) -> None:
        """One drive more."""
        self.behaviours, self.gaps = np.vstack([self.behaviours, behaviour]), np.append(self.gaps, gap_m)

    def distances(self, behaviour: np.ndarray) -> np.ndarray:
        """From behaviours (n, 6) to those driven, m (n, driven)."""
        distance: np.ndarray = np.linalg.norm(behaviour[:, None] - self.behaviours[None], axis=2)
        return distance

    def expected_gap(self, paths: np.ndarray, lengths: np.ndarray) -> np.ndarray:
        """Inverse distance weighting with exponent 2, m (n,); 0 for all while nothing was driven."""
        if not len(self.gaps):
            return np.zeros(len(paths))
        weights = 1.0 / np.maximum(self.distances(behaviours(paths, lengths)), _NEAREST_M) ** 2
        expected: np.ndarray = weights @ self.gaps / weights.sum(axis=1)
        return expected


class Transferability(Physical):
    """Two objectives, one simulator, an archive of drives."""

    options: ClassVar[Options] = {
        "tolerated": Option(0.5, 0.0, 100.0, "expected gap of a controller that may be called the fittest, in radii of a goal"),
        "every": Option(3, 1, 100_000, "one in this many drives is of the fittest, the others of the least known behaviour"),
    }

    def __init__(self, setting: Setting, robot: TwoWheeled, space: ModelSpace) -> None:
        """A random population in the drawing."""
        super().__init__(setting, robot, space)
        self.archive, self.fixed = TransferArchive(), PhysicsSimulator(robot, setting.task, space.drawing)
        self.evolver = self.pareto = ParetoEvolver.start(robot, setting.task, setting.key, setting.spec, self.fixed)
        self.pareto.tolerated_m = setting.number("tolerated") * robot.radii_m[0]
        self.pareto.begin(self.fixed)

    def pick(self, evaluation: int) -> np.ndarray:
        """Step 2: of the first front, the behaviour that is least known; sometimes the fittest."""
        if evaluation % self.setting.whole("every") == 0 or not len(self.archive.gaps):
            return super().pick(evaluation)
        evolver, front = self.pareto, np.flatnonzero(self.pareto.fronts == 0)
        seen = behaviours(evolver.paths[front], evolver.population.lengths[front])
        furthest = front[self.archive.distances(seen).min(axis=1).argmax()]
        return self.plan(evolver.population.controller(int(furthest)))

    def learn(self, commands: np.ndarray, poses: np.ndarray, evaluation: int) -> None:
        """Step 3."""
        super().learn(commands, poses, evaluation)
        foretold = self.fixed.poses(commands)
        gap_m = float(np.linalg.norm(foretold[: len(poses), :2] - poses[:, :2], axis=1).mean())
        self.archive.add(behaviours(foretold[None], np.array([len(commands)]))[0], gap_m)

    def advance(self) -> None:
        """Steps 1 and 4."""
        with self.timed("evolution_cpu_s"):
            self.pareto.evolve_both(self.fixed, self.archive.expected_gap)


APPROACH = Transferability
