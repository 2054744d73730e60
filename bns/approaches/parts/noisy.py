"""Evolution under noise: a controller is as fit as the mean over several noisy simulations says.

Noise is as large as the errors of the networks on patterns that they did not learn from. That is the robot's own noise and the
networks' errors together, and nothing but drives is asked for it. Every controller of a generation has the same noise
(common random numbers); the next generation has other noise, so that nobody can adapt to it (Jakobi 1997).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bns.approaches.parts.base import Setting
from bns.approaches.parts.hybrid import HybridSimulator
from bns.bootstrap.simulators import NetworkSimulator
from bns.engine.evolution import Population
from bns.engine.patterns import PatternSet
from bns.engine.philox import Key
from bns.engine.snn import predict
from bns.errors import SpecError
from bns.robots.base import RandomStream, Robot, Scores
from bns.tasks import Task

FEWEST = 8
"""Validation patterns that a standard deviation is taken from: with n of them it is off by 1 / sqrt(2 n), here a quarter."""
ELITE = 0.1
"""Share of the population, by fitness, that is simulated again before one of it is called the fittest."""
DRAWS = 256
"""Noisy simulations of each of these: a success rate of 95 % is then known to 1.4 points."""


def check_noise(setting: Setting) -> None:
    """SpecError for a robot that cannot be told its noise, or for options that simulate without the robot's kernels."""
    robot = setting.robot
    if not hasattr(robot, "expected"):
        raise SpecError(f"approach bns+noise: robot {robot.name} takes no noise from an approach; use bns without it.")
    if (use := setting.chosen("use")) == "worst":
        raise SpecError(f"approach bns+noise: it cannot be combined with use={use}; leave one of them out.")


def check_missed(setting: Setting) -> None:
    """SpecError for a price of goals missed under noise where there is no noise."""
    if setting.options["missed"] and not setting.options["noise"]:
        raise SpecError("approach bns+missed: goals are missed under noise, of which there is none; add some, such as noise=16.")


def residual_sd(robot: Robot, weights: np.ndarray, patterns: PatternSet) -> np.ndarray:
    """Root mean squares (networks,), SI, of the errors of networks (networks, W) on patterns; 0 for fewer than `FEWEST`."""
    if patterns.count < FEWEST:
        return np.zeros(len(weights))
    X, targets = patterns.inputs[:, : patterns.count], patterns.targets[:, : patterns.count]
    off = robot.displacements(predict(weights, X, robot.sigmoid_output)) - robot.displacements(targets)
    return np.sqrt(np.mean(off.astype(np.float64) ** 2, axis=0))


@dataclass(frozen=True)
class NoisySimulator:
    """Networks whose errors are known: fitness is that of the mean sum of distances over ``rows`` noisy simulations.

    Behind a physics model, the errors are those of the networks on what the model gets wrong: those of the sum.
    """

    networks: NetworkSimulator | HybridSimulator
    sd: np.ndarray
    """Standard deviations (networks,) of what one command does, SI."""
    rows: int
    foretells: bool = True
    missed_m: float = 0.0
    """Price beyond the robot's own penalty, m: of each goal missed, on the mean, and of the share of simulations that fail."""

    def score(self, population: Population, stream: RandomStream | None = None, parents: Scores | None = None) -> Scores:
        """Under the draws of the stream; goals reached are the mean, rounded. Without a stream there is no noise."""
        scores = self.networks.score(population, stream, parents)
        if stream is None:
            return scores
        found = self._expected(population, scores, self.networks.task, self.rows, stream)
        return scores._replace(
            fitness=self._fitness(found), goals_reached=np.rint(found.goals_reached).astype(np.int32), failures=found.failures
        )

    def _fitness(self, found: Any) -> np.ndarray:
        if not self.missed_m:
            return np.asarray(found.fitness)
        missed = len(self.networks.task.goals_m) - found.goals_reached + 1 - found.success
        return np.asarray(found.fitness / (1 + found.fitness * self.missed_m * missed))  # 0, for failed arithmetic, stays 0

    def success(self, population: Population, task: Task, stream: RandomStream) -> tuple[np.ndarray, np.ndarray]:
        """Share of `DRAWS` noisy simulations in which a task's goals are all reached (n,), and the fitness over them (n,)."""
        found = self._expected(population, self.networks.score(population), task, DRAWS, stream)
        return found.success, found.fitness

    def _expected(self, population: Population, scores: Scores, task: Task, rows: int, stream: RandomStream) -> Any:
        robot: Any = self.networks.robot
        return robot.expected(population, self.networks.predicted_outputs(population, scores), task, self.sd, rows, stream)

    def plan(self, controller: np.ndarray, stream: RandomStream | None = None) -> np.ndarray:
        """A controller is driven as it is without noise."""
        return self.networks.plan(controller, stream)

    def poses(self, commands: np.ndarray) -> np.ndarray:
        """Without noise."""
        return self.networks.poses(commands)


def most_certain(simulator: NoisySimulator, population: Population, order: np.ndarray, task: Task, key: Key, step: int) -> int:
    """Of the elite of a population, by its order, the controller that succeeds most often; of equals the fittest of them.

    A few noisy simulations order a population well enough to breed from, but the first of 400 then owes its place to luck.
    """
    who = order[: max(1, round(ELITE * len(order)))]
    elite = Population(population.commands[who], population.lengths[who])
    success, fitness = simulator.success(elite, task, RandomStream(key, step))
    return int(who[np.lexsort((-fitness, -success))[0]])
