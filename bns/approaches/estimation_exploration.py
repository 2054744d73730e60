"""Estimation-exploration: models that explain all drives, and drives on which these models disagree.

After Bongard and Lipson ("Nonlinear system identification using coevolution of models and tests", 2005):

1. exploration: of many tests the one on which the models disagree most is driven: `pick`, in the first evaluations
2. estimation: models, their numbers and which effects they have, evolve to explain all that was driven: `advance`
3. controllers evolve on the best model, and the fittest is driven: `advance` and `pick`, after the tests

Silent there, chosen here: a model is the drawing with any of `CATALOGUE`'s effects; its error is that of displacements, with one
percent on top for every effect, so that of equals the simplest wins; disagreement is the variance of the positions that the best
models (option ``voters``) foretell, summed over the commands; a test is one of ``candidates`` random command lists. The
population of models goes on from test to test. Drives of step 3 are learned from as well.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from bns.approaches.parts.base import Option, Options, Setting
from bns.approaches.parts.model_population import ModelPopulation
from bns.approaches.parts.physical import Physical
from bns.approaches.parts.physics_models import CATALOGUE, ModelSpace
from bns.bootstrap.simulators import PhysicsSimulator
from bns.engine.evolution import Population
from bns.physics.model import Model
from bns.robots.base import TwoWheeled

COST_OF_AN_EFFECT = 0.01


def disagreement(simulators: list[PhysicsSimulator], tests: Population) -> np.ndarray:
    """Variance, over simulators, of the positions after every command, summed over a test's commands, m² (tests,)."""
    paths = np.stack([simulator.paths(tests)[..., :2] for simulator in simulators])
    driven = np.arange(paths.shape[2]) < tests.lengths[:, None]
    total: np.ndarray = (paths.var(axis=0).sum(axis=2) * driven).sum(axis=1)
    return total


class EstimationExploration(Physical):
    """Tests first, then the task."""

    effects = CATALOGUE
    options: ClassVar[Options] = {
        "tests": Option(0.3, 0.0, 1.0, "fraction of the evaluations that are tests"),
        "commands": Option(10, 1, 1000, "commands in a test"),
        "candidates": Option(40, 1, 100_000, "random tests of which one is driven; 1: tests are random"),
        "models": Option(12, 2, 10_000, "models in their population"),
        "voters": Option(6, 2, 10_000, "best models that are asked which test to drive"),
        "generations": Option(3, 1, 10_000, "generations of models after each drive"),
    }

    def __init__(self, setting: Setting, robot: TwoWheeled, space: ModelSpace) -> None:
        """Models around the drawing, none of which has been judged."""
        super().__init__(setting, robot, space)
        self.models = ModelPopulation(space, setting.whole("models"), setting.generator(0), free_structure=True)
        self.testing = setting.share("tests")

    def pick(self, evaluation: int) -> np.ndarray:
        """Step 1, then the fittest."""
        return self._test(evaluation) if evaluation <= self.testing else super().pick(evaluation)

    def advance(self) -> None:
        """Step 2; and 3, once the tests are over."""
        if len(self.drives):
            with self.timed("training_cpu_s"):
                random = self.setting.generator(len(self.drives))
                self.models.judge(self._error)
                for _ in range(self.setting.whole("generations")):
                    self.models.breed(self._error, random)
                self.use(self.models.best)
        if len(self.drives) >= self.testing:
            self.evolve()

    def _test(self, evaluation: int) -> np.ndarray:
        key = self.setting.own_key(f"test {evaluation}")
        tests = self.robot.random_controllers(key, self.setting.whole("candidates"), self.setting.whole("commands"))
        voters = range(min(self.setting.whole("voters"), len(self.models)))
        simulators = [PhysicsSimulator(self.robot, self.setting.task, self.models.model(rank)) for rank in voters]
        return self.plan(tests.controller(int(disagreement(simulators, tests).argmax())))

    def _error(self, model: Model) -> float:
        return self.drives.error(model) * (1 + COST_OF_AN_EFFECT * len(model.effects))


APPROACH = EstimationExploration
