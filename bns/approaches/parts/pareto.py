"""NSGA-II on controllers: fitness on a physics model, and how far from the world a controller is thought to be.

Sorting into fronts and crowding distances are pymoo's (Blank and Deb, 2020), which is kept up and has an author of NSGA-II among
its own. Variation is the robot's, as in every approach, so that the same controllers are searched.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from bns.bootstrap.evolver import Evolver, Generation
from bns.bootstrap.simulators import PhysicsSimulator
from bns.engine.evolution import Population
from bns.extras import extra
from bns.robots.base import Scores

Gap = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Of paths (n, longest, 3) and lengths (n,): the gap that is expected of each, m (n,)."""


def no_gap(paths: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """What is expected before anything was driven: 0 for all."""
    return np.zeros(len(paths))


@dataclass
class ParetoEvolver(Evolver):
    """A population under two objectives. `order` begins with the one to be driven for the task, then front by front.

    paths (n, longest, 3), gaps (n,), fronts (n,): of each controller on the simulator, which stays; the front it is in, from 0.
    """

    tolerated_m: float = 0.035
    """Gap that a controller may be expected to have to be called the fittest."""
    paths: np.ndarray = field(init=False)
    gaps: np.ndarray = field(init=False)
    fronts: np.ndarray = field(init=False)

    def begin(self, simulator: PhysicsSimulator, gap: Gap = no_gap) -> None:
        """Simulate the population that there is."""
        self.paths = simulator.paths(self.population)
        self._rank(gap)

    def evolve_both(self, simulator: PhysicsSimulator, gap: Gap) -> None:
        """Generations of NSGA-II, gaps as ``gap`` expects them now: parents and children together, the better half goes on."""
        self.history.clear()
        self._rank(gap)
        for _ in range(self.spec.generations_per_evaluation):
            self.generations += 1
            self.bound_hits += self.robot.breed(
                self.key, self.population, self.order, self._parents, self.spec.mutation_rate, self.spec.min_commands,
                self.generations, self._spare,
            )  # fmt: skip
            self._survive(simulator, gap)
            if self.spec.record == "full":
                self.history.append(Generation(self.generations, self.fittest(), self.best_fitness, self.mean_fitness))

    def _survive(self, simulator: PhysicsSimulator, gap: Gap) -> None:
        children, n = self._spare, len(self.population)
        paths = simulator.paths(children)
        scored = simulator.walk(children, paths)
        self.failures += scored.failures
        own = self.population
        everybody = Population(np.vstack([own.commands, children.commands]), np.concatenate([own.lengths, children.lengths]))
        self.paths = _stacked(self.paths, paths)
        self.scores = Scores(
            np.concatenate([self.scores.fitness, scored.fitness]),
            np.concatenate([self.scores.goals_reached, scored.goals_reached]),
            scored.failures,
        )
        self.population = everybody
        self._rank(gap)
        self._keep(self.order[:n])
        self._rank(gap)

    def _rank(self, gap: Gap) -> None:
        self.gaps = gap(self.paths, self.population.lengths)
        self.fronts, crowding = fronts_of(np.column_stack([-self.scores.fitness, self.gaps]))
        order = np.lexsort((-crowding, self.fronts))
        self.order = np.concatenate([[chosen := self._chosen()], order[order != chosen]])

    def _chosen(self) -> int:
        """The best fitness among those whose gap is tolerated; the least gap where it is of none."""
        near = self.gaps <= self.tolerated_m
        return int(np.where(near, self.scores.fitness, -1.0).argmax()) if near.any() else int(self.gaps.argmin())

    def _keep(self, who: np.ndarray) -> None:
        self.population = Population(self.population.commands[who], self.population.lengths[who])
        self.paths = self.paths[who]
        self.scores = Scores(self.scores.fitness[who], self.scores.goals_reached[who], self.scores.failures)


def fronts_of(objectives: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The front of each (n,), from 0, and its crowding distance within it (n,); objectives (n, k) are minimised.

    Whoever repeats the objectives of one before stands in a last front of all repetitions, so that these do not fill the others.
    MissingExtraError without pymoo.
    """
    with extra("approaches"):
        from pymoo.operators.survival.rank_and_crowding.metrics import calc_crowding_distance  # noqa: PLC0415
        from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting  # noqa: PLC0415  # a second to import
    firsts = np.sort(np.unique(objectives, axis=0, return_index=True)[1])
    rank, crowding = np.full(len(objectives), len(objectives)), np.zeros(len(objectives))
    for number, front in enumerate(NonDominatedSorting().do(objectives[firsts])):
        rank[firsts[front]], crowding[firsts[front]] = number, calc_crowding_distance(objectives[firsts[front]])
    return rank, crowding


def _stacked(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Paths (n, a, 3) and (m, b, 3) as (n + m, longer, 3); the shorter ones stay where they end."""
    longest = max(first.shape[1], second.shape[1])
    return np.vstack([np.pad(one, ((0, 0), (0, longest - one.shape[1]), (0, 0)), mode="edge") for one in (first, second)])
