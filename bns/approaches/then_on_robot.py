"""Evolution in simulation, then on the robot.

After Pollack, Lipson, Ficici, Funes, Hornby and Watson ("Evolutionary techniques in physical robotics", 2000), whose controllers
evolved in a simulator for some hundred generations and went on evolving on the robot:

1. to 3. a simulator is made and controllers evolve on it: `Precomputed`
4. the best of that population go on evolving on the robot, each fitness a drive: `pick` and `learn` from then on

Silent there, chosen here: the simulator is one of networks, trained once on the first evaluations (option ``data``); as many of
the best as option ``population`` says go over, each different one once.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from bns.approaches.parts.base import Option, Options
from bns.approaches.parts.robot_evolution import RobotEvolution
from bns.approaches.precomputed import Precomputed
from bns.bootstrap.simulators import NoSimulator
from bns.engine.evolution import Population


class ThenOnRobot(Precomputed):
    """Pre-computed networks give the first generation of an evolution on the robot."""

    options: ClassVar[Options] = {
        **Precomputed.options,
        "data": Option(0.3, 0.0, 1.0, "fraction of the evaluations whose commands are random"),
        "population": Option(10, 2, 10_000, "number of controllers that continue to evolve on the robot"),
    }
    on_robot: RobotEvolution | None = None

    def pick(self, evaluation: int) -> np.ndarray:
        """Random commands while data is gathered; then whose turn it is on the robot."""
        return super().pick(evaluation) if self.on_robot is None else self.plan(self.on_robot.next())

    def learn(self, commands: np.ndarray, poses: np.ndarray, evaluation: int) -> None:
        """Data at first; then the fitness of one controller."""
        super().learn(commands, poses, evaluation)
        if self.on_robot is not None:
            self.on_robot.driven(*self.setting.robot.evaluate_path(poses, self.setting.task))

    def evolve(self) -> None:
        """On the networks, until the robot has taken over."""
        if self.on_robot is None:
            super().evolve()

    def evolve_until_done(self) -> None:
        """As `Precomputed`; then the robot takes over."""
        super().evolve_until_done()
        self.on_robot = RobotEvolution(self.setting, self._best(self.setting.whole("population")))
        self.simulator = NoSimulator(self.setting.robot, self.setting.task)

    def fittest(self) -> np.ndarray:
        """The best in simulation; once on the robot, the best that was driven."""
        return super().fittest() if self.on_robot is None else self.on_robot.fittest()

    def measures(self) -> dict[str, Any]:
        """Fitness in simulation, then as measured; generations of both."""
        known = super().measures()
        if self.on_robot is None:
            return known
        own = self.on_robot.measures()
        return known | own | {name: known[name] + own[name] for name in ("generations", "bound_hits")}

    def _best(self, count: int) -> Population:
        """The best different controllers; the best again and again where there are too few."""
        population, seen, chosen = self.evolver.population, set(), []
        for index in self.evolver.order:
            if (content := population.controller(int(index)).tobytes()) not in seen:
                seen.add(content)
                chosen.append(int(index))
        chosen = (chosen + [chosen[0]] * count)[:count]
        return Population(population.commands[chosen].copy(), population.lengths[chosen].copy())


APPROACH = ThenOnRobot
