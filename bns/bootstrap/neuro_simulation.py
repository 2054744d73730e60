"""Simulator networks and the population that evolves on them: what a run knows, and what it makes of a drive."""

from __future__ import annotations

from dataclasses import dataclass
from time import thread_time

import numpy as np

from bns.bootstrap.evolver import Evolver
from bns.bootstrap.trainer import Trainer
from bns.engine.philox import Key
from bns.robots.base import Robot
from bns.spec import RunSpec
from bns.tasks import Task


@dataclass
class NeuroSimulation:
    """Training networks, evolution networks (networks, W), the population, and CPU seconds spent since the last row."""

    robot: Robot
    task: Task
    trainer: Trainer
    weights: np.ndarray
    evolver: Evolver
    training_cpu_s: float = 0.0
    evolution_cpu_s: float = 0.0

    @classmethod
    def start(cls, robot: Robot, task: Task, key: Key, spec: RunSpec) -> NeuroSimulation:
        """Untrained networks, and a random population scored on them."""
        trainer = Trainer.start(robot, key, spec)
        weights = trainer.evolution_weights()
        return cls(robot, task, trainer, weights, Evolver.start(robot, task, key, spec, weights))

    def pick(self, evaluation: int) -> np.ndarray:
        """The commands (n, components) to be driven next."""
        return self.evolver.plan(self.evolver.pick(evaluation), self.weights)

    def learn(self, commands: np.ndarray, poses: np.ndarray, evaluation: int) -> None:
        """Take what a drive measured into the training set: poses (m, columns) of commands (n, components), m <= n."""
        began = thread_time()
        self.trainer.add(commands, poses, evaluation)
        self.training_cpu_s += thread_time() - began

    def advance(self) -> None:
        """One round: train, copy the training networks over the evolution networks, evolve on those."""
        began = thread_time()
        self.trainer.train()
        trained = thread_time()
        self.weights = self.trainer.evolution_weights()
        self.evolver.evolve(self.weights)
        self.training_cpu_s += trained - began
        self.evolution_cpu_s += thread_time() - trained

    def take_cpu_s(self) -> tuple[float, float]:
        """CPU seconds of training and of evolution since this was asked last."""
        spent = self.training_cpu_s, self.evolution_cpu_s
        self.training_cpu_s = self.evolution_cpu_s = 0.0
        return spent
