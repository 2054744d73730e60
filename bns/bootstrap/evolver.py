"""The population of one run and how it evolves on the current simulator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from bns.bootstrap.simulators import Simulator
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
    """Population, its fitness on the simulator it was last scored on, and counters of what went wrong."""

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
    after_breeding: Callable[[Population, int], None] | None = None
    """What else changes children, in place, before they are scored; their generation is told. The first one is the elite."""

    @classmethod
    def start(cls, robot: Robot, task: Task, key: Key, spec: RunSpec, simulator: Simulator) -> Self:
        """A random population, scored on a first simulator."""
        population = robot.initial_population(key, spec.population_size, spec.min_commands, spec.max_commands)
        return cls(robot, task, key, spec, population, simulator.score(population, RandomStream(key, 0)))

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

    def plan(self, controller: np.ndarray, simulator: Simulator, generation: int | None = None) -> np.ndarray:
        """What is driven of a controller of this generation, or of an earlier one: cut under the draws it was scored with."""
        return simulator.plan(controller, RandomStream(self.key, self.generations if generation is None else generation))

    def evolve(self, simulator: Simulator) -> None:
        """Score the population on a new simulator, then breed and score generation after generation."""
        self.history.clear()
        self._score(simulator)
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
            if self.after_breeding:
                self.after_breeding(self.population, self.generations)
            self._score(simulator, self.scores)
            if self.spec.record == "full":
                self.history.append(Generation(self.generations, self.fittest(), self.best_fitness, self.mean_fitness))

    def replace(self, who: np.ndarray, others: Population) -> None:
        """Put others, as many as there are controllers, in the places of some; they are scored when evolution goes on."""
        self.population.commands[who], self.population.lengths[who] = others.commands[who], others.lengths[who]
        self.population.origin[who] = -1

    def put(self, who: int, controller: np.ndarray, simulator: Simulator) -> None:
        """A controller (n, components) in the place of one; all are scored again on the simulator, with the draws of before."""
        self.population.commands[who, : len(controller)], self.population.lengths[who] = controller, len(controller)
        self.population.origin[who] = -1
        self._score(simulator)

    def _score(self, simulator: Simulator, parents: Scores | None = None) -> None:
        stream = RandomStream(self.key, self.generations)
        self.scores = simulator.score(self.population, stream, parents)
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
