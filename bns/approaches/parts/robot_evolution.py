"""A population whose fitness is measured on the robot, one drive each."""

from __future__ import annotations

import numpy as np

from bns.approaches.parts.base import Setting
from bns.engine.evolution import Population, rank, tournament_cdf
from bns.robots.base import Scores


class RobotEvolution:
    """Controllers that take their turns; a generation is bred once all were driven.

    The best goes on unchanged with the fitness that it had, and is not driven again: the robot's time goes to those not known.
    """

    def __init__(self, setting: Setting, population: Population) -> None:
        """A first generation, of which nobody has been driven."""
        self._setting, self.population = setting, population
        self.fitness = np.full(len(population), np.nan)
        self.reached = np.zeros(len(population), np.int32)
        self._spare = Population(np.zeros_like(population.commands), np.zeros_like(population.lengths))
        self._parents = tournament_cdf(len(population), setting.spec.tournament_size)
        self._turn = self.generations = self.bound_hits = 0

    def next(self) -> np.ndarray:
        """The controller whose turn it is."""
        return self.population.controller(self._turn)

    def driven(self, fitness: float, goals_reached: int) -> None:
        """It was driven, with this fitness; after the last one the next generation is bred."""
        self.fitness[self._turn], self.reached[self._turn] = fitness, goals_reached
        self._turn += 1
        if self._turn == len(self.population):
            self._breed()

    def fittest(self) -> np.ndarray:
        """The best of those driven; before any was, the first."""
        return self.population.controller(self._best())

    def measures(self) -> dict[str, float]:
        """Columns of evals: measured fitness where others have that in simulation."""
        known = self.fitness[~np.isnan(self.fitness)]
        scores = Scores(np.nan_to_num(self.fitness), self.reached, 0)
        return {
            "diversity": self._setting.robot.diversity(self.population, scores),
            "best_fitness": float(known.max()) if known.size else float("nan"),
            "mean_fitness": float(known.mean()) if known.size else float("nan"),
            "mean_commands": float(self.population.lengths.mean()),
            "generations": self.generations,
            "bound_hits": self.bound_hits,
        }

    def _best(self) -> int:
        return 0 if np.isnan(self.fitness).all() else int(np.nanargmax(self.fitness))

    def _breed(self) -> None:
        best, spec = self._best(), self._setting.spec
        self.generations += 1
        self.bound_hits += self._setting.robot.breed(
            self._setting.own_key("robot"), self.population, rank(self.fitness), self._parents, spec.mutation_rate,
            spec.min_commands, self.generations, self._spare,
        )  # fmt: skip
        self.population, self._spare = self._spare, self.population
        kept, reached = self.fitness[best], self.reached[best]
        self.fitness, self.reached = np.full(len(self.fitness), np.nan), np.zeros_like(self.reached)
        self.fitness[0], self.reached[0], self._turn = kept, reached, 1
