"""Simulator networks that learn from drives, and the population that evolves on copies of them."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np

from bns.approaches.parts.base import Setting
from bns.approaches.parts.evolving import Evolving
from bns.bootstrap.simulators import NetworkSimulator, Simulator
from bns.bootstrap.trainer import Learner, Trainer
from bns.tasks import Task


class NeuroSimulation(Evolving):
    """Training networks (`trainer`), evolution networks (`weights`, copies of them), and the population."""

    networked: ClassVar[bool] = True

    def __init__(self, setting: Setting, trainer: Learner) -> None:
        """With networks as they are."""
        self.setting, self.trainer, self.weights = setting, trainer, trainer.evolution_weights()
        super().__init__(setting, self.simulator_now())

    @classmethod
    def start(cls, setting: Setting) -> Self:
        """Untrained networks."""
        return cls(setting, Trainer.start(setting.robot, setting.key, setting.spec))

    def learn(self, commands: np.ndarray, poses: np.ndarray, evaluation: int) -> None:
        """Take what a drive measured into the training set."""
        with self.timed("training_cpu_s"):
            self.trainer.add(commands, poses, evaluation)

    def train(self) -> None:
        """Train on all that was driven."""
        with self.timed("training_cpu_s"):
            self.trainer.train()

    def copy(self) -> None:
        """The training networks over the evolution networks."""
        with self.timed("evolution_cpu_s"):
            self.weights = self.trainer.evolution_weights()
            self.simulator = self.simulator_now()

    def simulator_now(self) -> Simulator:
        """What evolution works on from now on."""
        return NetworkSimulator(self.setting.robot, self.goals(), self.weights)

    def goals(self) -> Task:
        """The task that evolution is asked to do."""
        return self.setting.task

    def measures(self) -> dict[str, Any]:
        """With the errors of the networks, and how much they learn from."""
        data, (training_error, validation_error) = self.trainer.data, self.trainer.errors()
        known = super().measures()
        return known | {
            "training_error": training_error,
            "validation_error": validation_error,
            "training_patterns": data.training.count,
            "validation_patterns": data.validation.count,
            "arithmetic_failures": known["arithmetic_failures"] + self.trainer.failures,
        }

    @property
    def learned_from(self) -> np.ndarray:
        """Inputs (inputs, patterns) of the training set."""
        return self.trainer.data.training.in_use()
