"""The population of one run and how it evolves on the current simulator networks."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bns.engine.evolution import Population, pick, rank, tournament_cdf
from bns.engine.philox import Key, Purpose
from bns.robots.base import RandomStream, Robot, Scores
from bns.spec import RunSpec
from bns.tasks import Task


@dataclass
class Generation:
    """What a generation left behind: its number, its best controller, best and mean fitness in simulation."""

    number: int
    best: np.ndarray
    best_fitness: float
    mean_fitness: float


@dataclass
class Evolver:
    """Population, its fitness on the networks it was last scored on, and counters of what went wrong."""

    robot: Robot
    task: Task
    key: Key
    spec: RunSpec
    population: Population
    scores: Scores
    generations: int = 0
    bound_hits: int = 0
    failures: int = 0
    history: list[Generation] = field(default_factory=list)

    @classmethod
    def start(cls, robot: Robot, task: Task, key: Key, spec: RunSpec, weights: np.ndarray) -> Evolver:
        """A random population, scored on untrained networks."""
        population = robot.initial_population(key, spec.population_size, spec.min_commands, spec.max_commands)
        return cls(robot, task, key, spec, population, robot.score(population, weights, task, RandomStream(key, 0)))

    def __post_init__(self) -> None:
        self.order = rank(self.scores.fitness)
        self._spare = Population(np.zeros_like(self.population.commands), np.zeros_like(self.population.lengths))
        self._parents = tournament_cdf(len(self.population), self.spec.tournament_size)
        self._real_world = tournament_cdf(len(self.population), self.spec.real_world_selection_size)

    def pick(self, evaluation: int) -> np.ndarray:
        """The controller that drives in the world next: the winner of the real-world selection tournament."""
        return self.population.controller(pick(self.key, Purpose.PICK, evaluation, self.order, self._real_world))

    def fittest(self) -> np.ndarray:
        """The best controller in simulation."""
        return self.population.controller(int(self.order[0]))

    def plan(self, controller: np.ndarray, weights: np.ndarray, generation: int | None = None) -> np.ndarray:
        """What is driven of a controller of this generation, or of an earlier one: cut under the draws it was scored with."""
        stream = RandomStream(self.key, self.generations if generation is None else generation)
        return self.robot.plan(controller, weights, self.task, stream)

    def evolve(self, weights: np.ndarray) -> None:
        """Score the population on new networks, then breed and score generation after generation."""
        self.history.clear()
        self._score(weights)
        for _ in range(self.spec.generations_per_evaluation):
            self.generations += 1
            self.bound_hits += self.robot.breed(
                self.key,
                self.population,
                self.order,
                self._parents,
                self.spec.mutation_rate,
                self.spec.min_commands,
                self.generations,
                self._spare,
            )
            self.population, self._spare = self._spare, self.population
            self._score(weights, self.scores)
            if self.spec.record == "full":
                self.history.append(Generation(self.generations, self.fittest(), self.best_fitness, self.mean_fitness))

    def _score(self, weights: np.ndarray, parents: Scores | None = None) -> None:
        stream = RandomStream(self.key, self.generations)
        self.scores = self.robot.score(self.population, weights, self.task, stream, parents)
        self.order = rank(self.scores.fitness)
        self.failures += self.scores.failures

    @property
    def best_fitness(self) -> float:
        """Fitness of the best controller in simulation."""
        return float(self.scores.fitness[self.order[0]])

    @property
    def mean_fitness(self) -> float:
        """Mean fitness of the population in simulation."""
        return float(self.scores.fitness.mean())

    def diversity(self) -> float:
        """Diversity of the population, as the robot's study defines it."""
        return self.robot.diversity(self.population, self.scores)
