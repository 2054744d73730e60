"""Pre-computed simulator neural networks: data first, training once, then evolution alone.

After Pretorius, du Plessis and Cilliers ("Simulating robots without conventional physics: a neural network approach", Journal of
Intelligent & Robotic Systems, 2013) and the dissertation's sections 2.5 and 5.4:

1. random commands are driven and measured: `pick` in the first evaluations, `learn`
2. the networks are trained, once: `advance` after the last of these
3. controllers evolve on the networks, which stay as they are: `advance` from then on
4. the fittest is driven: `pick` from then on

Silent there, chosen here: how the robot's time is divided (option ``data``: the share of evaluations that are random); how long
step 3 lasts before the first drive (until the fittest finishes the task in simulation, for at most `MOST_ROUNDS` rounds of the
spec's generations); it goes on by one round with every drive, as computers do while a robot drives. Drives after step 2 teach
nothing. What the recorded figures say of the fittest during step 1 is of untrained networks.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from bns.approaches.parts.base import Option, Options, Setting
from bns.approaches.parts.neuro_simulation import NeuroSimulation
from bns.bootstrap.trainer import Trainer

MOST_ROUNDS = 25
"""500 generations at the prototype's 20, as in the dissertation's trials of its static simulators (section 5.4.2)."""


class Precomputed(NeuroSimulation):
    """Random drives, one training, evolution on networks that stay."""

    options: ClassVar[Options] = {
        "data": Option(0.5, 0.0, 1.0, "fraction of the evaluations whose commands are random"),
        "commands": Option(10, 1, 1000, "commands in each of these"),
        "iterations": Option(20_000, 1, 10_000_000, "Rprop iterations of the one training"),
    }

    def __init__(self, setting: Setting, trainer: Trainer) -> None:
        """Before any data."""
        trainer.iterations = setting.whole("iterations")
        super().__init__(setting, trainer)
        self.gathering, self._trained = setting.share("data"), False
        self._random = setting.robot.random_controllers(
            setting.own_key("data"), self.gathering, setting.whole("commands")
        )
        self._gathered = 0

    def pick(self, evaluation: int) -> np.ndarray:
        """Steps 1 and 4: random commands while data is gathered, then the fittest."""
        if evaluation <= self.gathering:
            return self.setting.robot.plan(self._random.controller(evaluation - 1), None, self.setting.task)
        return self.plan(self.fittest())

    def learn(self, commands: np.ndarray, poses: np.ndarray, evaluation: int) -> None:
        """Step 1: data; later drives teach nothing."""
        if evaluation <= self.gathering:
            super().learn(commands, poses, evaluation)
            self._gathered = evaluation

    def advance(self) -> None:
        """Steps 2 and 3, once all data is there."""
        if self._gathered < self.gathering:
            return
        if self._trained:
            self.evolve()
        else:
            self._trained = True
            self.train()
            self.copy()
            self.evolve_until_done()

    def evolve_until_done(self) -> None:
        """Until the fittest finishes the task in simulation, or for `MOST_ROUNDS` rounds."""
        for _ in range(MOST_ROUNDS):
            self.evolve()
            if self.evolver.scores.goals_reached[self.evolver.order[0]] == len(self.setting.task.goals_m):
                break


APPROACH = Precomputed
