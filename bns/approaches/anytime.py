"""Anytime learning: a monitor keeps a physics model's numbers up to date while evolution goes on in it.

After Grefenstette and Ramsey ("An approach to anytime learning", 1992):

1. the execution system drives the best controller that there is: `pick`
2. the monitor estimates the environment's parameters from what was driven, means and spreads: `learn`
3. where they differ from those in the simulator, the simulator is changed, and the learning system begins anew in part: `_update`
4. evolution goes on in the simulator: `advance`, each generation in an environment drawn from the means and spreads

Silent there, chosen here: the estimate is the maximum of the posterior of a drawing's most common effects (`COMMON`), with a
normal prior of one spread, from the latest drives (option ``window``), so that a robot that changes is followed; spreads are
those of the Laplace approximation. "Differ" means by more than two spreads in any number. Option ``restart`` of the population
is replaced by random controllers then; the best stay.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.optimize import least_squares

from bns.approaches.parts.base import Option, Options, Setting
from bns.approaches.parts.physical import Physical
from bns.approaches.parts.physics_models import Drives, ModelSpace
from bns.bootstrap.simulators import PhysicsSimulator
from bns.engine.evolution import Population
from bns.engine.philox import Purpose
from bns.robots.base import RandomStream, Scores, TwoWheeled

DIFFERENT = 2.0
"""Spreads that a number must move by before the simulator is changed."""
_STEPS = 8
_INSIDE = 1e-3
"""A fit begins this far inside the bounds, in spreads."""


@dataclass(frozen=True)
class Estimate:
    """Means and spreads (size,) of a model space's numbers, and the noise that was left, in `physics_models.UNITS`."""

    mean: np.ndarray
    spread: np.ndarray
    noise: float = 1.0


def estimate(space: ModelSpace, drives: Drives, before: Estimate, window: int) -> Estimate:
    """Maximum of the posterior and the spreads around it, from the latest drives; ``before`` is where the search begins."""
    low, high = space.bounds

    def misfit(point: np.ndarray) -> np.ndarray:
        return np.concatenate([drives.residuals(space.model(point), window).ravel() / before.noise, point])

    begin = np.clip(before.mean, low + _INSIDE, high - _INSIDE)
    found = least_squares(misfit, begin, bounds=(low, high), diff_step=1e-3, x_scale=1.0, max_nfev=_STEPS)
    left = float(np.sqrt(np.mean((found.fun[: -space.size] * before.noise) ** 2)))
    spread = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))
    return Estimate(found.x, spread, max(left, 1e-3))


@dataclass(frozen=True)
class UncertainSimulator(PhysicsSimulator):
    """A physics model whose numbers are known with spreads: every generation is scored in another draw of them."""

    space: ModelSpace | None = None
    known: Estimate | None = None

    def score(self, population: Population, stream: RandomStream | None = None, parents: Scores | None = None) -> Scores:
        """On the means, without a stream."""
        if stream is None or self.space is None or self.known is None:
            return super().score(population)
        counter = np.array([0, 1, stream.step, Purpose.APPROACH], np.uint64)
        key = np.array([stream.key.seed, stream.key.study], np.uint64)
        draws = np.random.Generator(np.random.Philox(counter=counter, key=key)).normal(size=self.space.size)
        model = self.space.model(self.known.mean + draws * self.known.spread)
        return PhysicsSimulator(self.robot, self.task, model).score(population)


class Anytime(Physical):
    """Monitor, simulator, evolution."""

    options: ClassVar[Options] = {
        "window": Option(20, 1, 100_000, "latest drives that the monitor looks at"),
        "restart": Option(0.5, 0.0, 1.0, "fraction of the population that is drawn again when the simulator has changed"),
    }

    def __init__(self, setting: Setting, robot: TwoWheeled, space: ModelSpace) -> None:
        """Nothing is known but the drawing."""
        super().__init__(setting, robot, space)
        self.used = self.known = Estimate(np.zeros(space.size), np.ones(space.size))
        self.updates = 0

    def learn(self, commands: np.ndarray, poses: np.ndarray, evaluation: int) -> None:
        """Step 2."""
        super().learn(commands, poses, evaluation)
        with self.timed("training_cpu_s"):
            self.known = estimate(self.space, self.drives, self.known, self.setting.whole("window"))

    def advance(self) -> None:
        """Steps 3 and 4."""
        if (np.abs(self.known.mean - self.used.mean) > DIFFERENT * self.known.spread).any():
            self._update()
        self.evolve()

    def _update(self) -> None:
        self.used, self.updates = self.known, self.updates + 1
        model = self.space.model(self.known.mean)
        self.simulator = UncertainSimulator(self.robot, self.setting.task, model, True, self.space, self.known)
        spec, key = self.setting.spec, self.setting.own_key(f"restart {self.updates}")
        fresh = self.robot.initial_population(key, spec.population_size, spec.min_commands, spec.max_commands)
        worst = self.evolver.order[len(self.evolver.order) - round(self.setting.number("restart") * len(fresh)) :]
        self.evolver.replace(worst, fresh)


APPROACH = Anytime
