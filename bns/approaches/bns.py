"""Bootstrapped Neuro-Simulation (BNS): networks, population and drives from nothing, all at once.

After the dissertation, figure 3.1 and section 3.3: no data is collected before; what evolution finds promising is driven,
the networks learn from that, and the evolution goes on with them.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from bns.approaches.parts.base import Option, Options, Setting
from bns.approaches.parts.neuro_simulation import NeuroSimulation
from bns.bootstrap.trainer import Trainer
from bns.errors import SpecError
from bns.tasks import Task

STEPS = 10
"""In so many steps goals narrow by the whole margin; widening 3 and 10 times as fast did no better (five seeds, three tasks)."""


class BootstrappedNeuroSimulation(NeuroSimulation):
    """The four steps; driving is the loop's.

    ``margin`` goes beyond the dissertation: algorithm 2 rewards touching the edge of a goal, and a small error of the
    networks then misses it. Goals that are narrower in evolution than on the robot leave room for such errors. They
    narrow by a tenth of the margin after each round whose fittest controller reaches all of them in simulation, and
    widen by as much after any other: goals that nobody reaches lead nowhere.
    """

    options: ClassVar[Options] = {
        "margin": Option(0.0, 0.0, 1.0, "m by which goals become narrower in evolution, all around")
    }

    def __init__(self, setting: Setting, trainer: Trainer) -> None:
        """Goals as wide as they are."""
        self._narrowed = 0
        if setting.options["margin"]:
            self._check_margin(setting)
        super().__init__(setting, trainer)

    @staticmethod
    def _check_margin(setting: Setting) -> None:
        if not getattr(setting.robot, "narrows_goals", False):
            raise SpecError(
                f"approach bns+margin: robot {setting.robot.name} cannot narrow its goals; use bns without a margin."
            )
        _narrower(setting, setting.options["margin"])

    def pick(self, evaluation: int) -> np.ndarray:
        """Step 1: the winner of the real-world selection tournament."""
        return self.plan(self.evolver.pick(evaluation))

    def advance(self) -> None:
        """Steps 2 and 3: train, copy the training networks over the evolution networks, evolve on those."""
        self.train()
        self.copy()
        self.evolve()
        if self.setting.options["margin"]:
            scores, best = self.evolver.scores, self.evolver.order[0]
            all_reached = scores.goals_reached[best] == len(self.setting.task.goals_m)
            self._narrowed = min(self._narrowed + 1, STEPS) if all_reached else max(self._narrowed - 1, 0)

    def goals(self) -> Task:
        """The task with goals as narrow as they now are in evolution."""
        return _narrower(self.setting, self.setting.options["margin"] * self._narrowed / STEPS)


def _narrower(setting: Setting, margin_m: float) -> Task:
    radii_m = setting.robot.radii_m
    return setting.task.narrower(margin_m, radii_m[0] if radii_m else 0.0) if margin_m else setting.task


APPROACH = BootstrappedNeuroSimulation
