"""Evolution on the robot itself: no simulator, each fitness is a drive.

After Floreano and Mondada ("Automatic creation of an autonomous agent: genetic evolution of a neural-network driven robot",
1994):

1. every controller of the population is driven and its fitness measured: `pick`, `learn`
2. the fitter ones are selected and bred: crossover and mutation, in `RobotEvolution`
3. again, with the new population

They evolved the weights of a network with 80 controllers for 100 generations; chosen here, so that approaches are compared on the
same controllers: command lists, the spec's tournaments and operators, the best kept. The population is small (option
``population``), because 100 drives are what there is.
"""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np

from bns.approaches.parts.base import Option, Options, Setting
from bns.approaches.parts.evolving import Evolving
from bns.approaches.parts.robot_evolution import RobotEvolution
from bns.bootstrap.simulators import NoSimulator


class OnRobot(Evolving):
    """Each evaluation is one fitness."""

    options: ClassVar[Options] = {"population": Option(20, 2, 10_000, "controllers in the population")}

    @classmethod
    def start(cls, setting: Setting) -> Self:
        """A random population, and nothing that foretells."""
        return cls(setting, NoSimulator(setting.robot, setting.task))

    def __init__(self, setting: Setting, simulator: NoSimulator) -> None:
        """Before any drive."""
        super().__init__(setting, simulator)
        spec = setting.spec
        first = setting.robot.initial_population(
            setting.key, setting.whole("population"), spec.min_commands, spec.max_commands
        )
        self.on_robot = RobotEvolution(setting, first)

    def pick(self, evaluation: int) -> np.ndarray:
        """Step 1: whose turn it is."""
        return self.plan(self.on_robot.next())

    def learn(self, commands: np.ndarray, poses: np.ndarray, evaluation: int) -> None:
        """Its fitness; and steps 2 and 3 when all were driven."""
        with self.timed("evolution_cpu_s"):
            self.on_robot.driven(*self.setting.robot.evaluate_path(poses, self.setting.task))

    def advance(self) -> None:
        """Nothing goes on between drives."""

    def fittest(self) -> np.ndarray:
        """The best that was driven."""
        return self.on_robot.fittest()

    def measures(self) -> dict[str, Any]:
        """Fitness as measured."""
        return super().measures() | self.on_robot.measures()


APPROACH = OnRobot
