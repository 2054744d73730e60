"""What foretells a drive: the networks of a run, a physics model, or nothing at all."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from bns.engine.evolution import Population
from bns.engine.snn import predict
from bns.physics.model import Model
from bns.physics.wheels.differential_drive import simulate
from bns.robots.base import RandomStream, Robot, Scores, TwoWheeled
from bns.tasks import Task

STEP_S = 0.03
GROWTH = 1.4
"""Steps of a command in evolution: the first one in seconds, and by what factor each is longer than the one before.

Speeds change early in a command and settle later, and each step is an arc, so that only what changes within one is lost.
After ten commands with lag and slip, the median distance to the end at 5 ms is 0.05 to 0.13 mm, the largest 0.4 mm. Equal
steps of 50 ms are off by as much and take 2.5 times as long.
"""


class Simulator(Protocol):
    """Foretells drives. It never changes: whoever learns makes another one."""

    @property
    def foretells(self) -> bool:
        """False where there is no simulator: its paths are NaN, and it scores nobody."""

    def score(
        self, population: Population, stream: RandomStream | None = None, parents: Scores | None = None
    ) -> Scores:
        """Fitness of every controller; stream and parents as in `bns.robots.base.Fitness.score`."""

    def plan(self, controller: np.ndarray, stream: RandomStream | None = None) -> np.ndarray:
        """The commands (m, components) that are driven when this controller is picked; stream: the draws it was scored with."""

    def poses(self, commands: np.ndarray) -> np.ndarray:
        """Poses (n, columns) after each of these commands (n, components)."""


@dataclass(frozen=True)
class NetworkSimulator:
    """Networks (networks, W)."""

    robot: Robot
    task: Task
    weights: np.ndarray
    foretells: bool = True

    def score(
        self, population: Population, stream: RandomStream | None = None, parents: Scores | None = None
    ) -> Scores:
        """By the robot's own compiled kernels."""
        return self.robot.score(population, self.weights, self.task, stream, parents)

    def predicted_outputs(self, population: Population, scores: Scores) -> np.ndarray | None:
        """What each command of these scores does, in units of targets (networks, commands); None if the robot does not tell."""
        return scores.outputs

    def plan(self, controller: np.ndarray, stream: RandomStream | None = None) -> np.ndarray:
        """As the robot plans with networks."""
        return self.robot.plan(controller, self.weights, self.task, stream)

    def poses(self, commands: np.ndarray) -> np.ndarray:
        """One command's displacement after the other."""
        outputs = predict(self.weights, self.robot.inputs(commands), self.robot.sigmoid_output)
        return self.robot.poses(self.robot.displacements(outputs), commands)


@dataclass(frozen=True)
class PhysicsSimulator:
    """A physics model of a robot on two wheels, integrated in steps of `STEP_S`; neither jitter nor noise."""

    robot: TwoWheeled
    task: Task
    model: Model
    foretells: bool = True

    def score(
        self, population: Population, stream: RandomStream | None = None, parents: Scores | None = None
    ) -> Scores:
        """Every controller's commands are driven on the model; then the robot's walk over the goals, as for networks."""
        return self.walk(population, self.paths(population), stream)

    def walk(self, population: Population, paths: np.ndarray, stream: RandomStream | None = None) -> Scores:
        """Fitness of paths (n, longest, 3) that were simulated already."""
        start = np.broadcast_to(self.robot.start_pose()[0], (len(paths), 1, paths.shape[2]))
        there = np.arange(paths.shape[1] + 1) <= population.lengths[:, None]
        joined = np.concatenate([start, paths], axis=1)[there]  # all paths in one: the way back to the start is left out
        begins = np.cumsum(population.lengths + 1) - (population.lengths + 1)
        moved = self.robot.measured_displacements(joined)
        return self.robot.walk(population, np.delete(moved, begins, axis=0), self.task, stream)

    def paths(self, population: Population) -> np.ndarray:
        """Poses (n, longest, 3) of all controllers; a list that is shorter stays where it ends."""
        longest = int(population.lengths.max())
        commands = population.commands[:, :longest]
        left, right, duration = self.robot.wheel_speeds_m_s(commands.reshape(-1, commands.shape[2]).astype(np.float64))
        there = np.arange(longest) < population.lengths[:, None]
        sides = (np.where(there, values.reshape(there.shape), 0.0) for values in (left, right, duration))
        return simulate(replace(self.model, dt_s=STEP_S), *sides, start=self.robot.start_pose()[0], growth=GROWTH)

    def plan(self, controller: np.ndarray, stream: RandomStream | None = None) -> np.ndarray:
        """A controller is driven as it is."""
        return self.robot.plan(controller, None, self.task)

    def poses(self, commands: np.ndarray) -> np.ndarray:
        """The path of one controller."""
        return self.paths(Population(commands[None], np.array([len(commands)], np.int32)))[0]


@dataclass(frozen=True)
class NoSimulator:
    """Nothing is foretold: what an approach without a simulator has in its place."""

    robot: Robot
    task: Task
    foretells: bool = False

    def score(
        self, population: Population, stream: RandomStream | None = None, parents: Scores | None = None
    ) -> Scores:
        """Nobody has been driven yet: fitness 0, which ranks last."""
        n = len(population)
        return Scores(np.zeros(n), np.zeros(n, np.int32), 0)

    def plan(self, controller: np.ndarray, stream: RandomStream | None = None) -> np.ndarray:
        """All of its commands: nothing says how many the task needs."""
        return self.robot.plan(controller, None, self.task)

    def poses(self, commands: np.ndarray) -> np.ndarray:
        """NaN (n, columns)."""
        return np.full((len(commands), self.robot.start_pose().shape[1]), np.nan)
