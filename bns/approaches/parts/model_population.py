"""A population of physics models, bred to lower whatever error they are judged by."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bns.approaches.parts.physics_models import ModelSpace
from bns.physics.model import Model

MUTATION_SPREAD = 0.5
"""Standard deviation of a mutation, in spreads of the space."""
RATE = 0.3
"""Probability that a number mutates, and that an effect is switched on or off where structure is free."""

Judge = Callable[[Model], float]


class ModelPopulation:
    """Points of a model space, with the effects that each has on, best first."""

    def __init__(self, space: ModelSpace, size: int, random: np.random.Generator, free_structure: bool = False) -> None:
        """The drawing, and models around it; with free structure each has half of the effects."""
        self.space, self._free = space, free_structure
        self.points = random.normal(size=(size, space.size))
        self.points[0] = 0.0
        self.active = np.ones((size, len(space.effects)), bool)
        if free_structure:
            self.active = random.random(self.active.shape) < 0.5
            self.active[0] = False
        self.errors = np.full(size, np.inf)

    def __len__(self) -> int:
        return len(self.points)

    @property
    def best(self) -> Model:
        """The model with the least error when it was judged last."""
        return self.model(0)

    def model(self, index: int) -> Model:
        """The model of that rank, from 0."""
        return self.space.model(self.points[index], self.active[index])

    def judge(self, judge: Judge) -> None:
        """Judge all by what is known now, and rank them; equals keep their order, NaN comes last."""
        self.errors = np.array([judge(self.model(index)) for index in range(len(self))])
        self._keep(np.argsort(np.nan_to_num(self.errors, nan=np.inf), kind="stable"))

    def breed(self, judge: Judge, random: np.random.Generator) -> None:
        """One generation: a child for everybody, by uniform crossover and mutation; the better half of all goes on."""
        mothers, fathers = (self._winners(random) for _ in range(2))
        from_mother = random.random(self.points.shape) < 0.5
        points = np.where(from_mother, self.points[mothers], self.points[fathers])
        points += random.normal(0.0, MUTATION_SPREAD, points.shape) * (random.random(points.shape) < RATE)
        active = np.where(random.random(self.active.shape) < 0.5, self.active[mothers], self.active[fathers])
        if self._free:
            active = active ^ (random.random(active.shape) < RATE / 2)
        own = self.space.bounds
        children = [judge(self.space.model(point, on)) for point, on in zip(points, active, strict=True)]
        self.points, self.active = np.vstack([self.points, np.clip(points, *own)]), np.vstack([self.active, active])
        self.errors = np.concatenate([self.errors, children])
        self._keep(np.argsort(np.nan_to_num(self.errors, nan=np.inf), kind="stable")[: len(mothers)])

    def _winners(self, random: np.random.Generator) -> np.ndarray:
        """Ranks of the winners of tournaments of two."""
        return random.integers(0, len(self), (2, len(self))).min(axis=0)

    def _keep(self, order: np.ndarray) -> None:
        self.points, self.active, self.errors = self.points[order], self.active[order], self.errors[order]
