"""Back to reality: simulators co-evolve with controllers, judged by differences of fitness alone.

After Zagal and Ruiz-del-Solar ("Combining simulation and reality in evolutionary robotics", 2007) and equation 2.10
of the dissertation:

1. controllers evolve on the best simulator: `advance`
2. some of them are driven, and their fitness in reality is kept: `pick`, `learn`
3. simulators evolve so that the mean difference of fitness over the latest drives falls: `advance`
4. again from 1, on the simulator that is best now

Silent there, chosen here: a simulator is a point in the space of a drawing's most common effects (`COMMON`); the driven one is
the winner of the spec's real-world selection tournament; one drive a round; the latest ``memory`` drives count. Nothing but
fitness is used of a drive, which is the approach's point: no tracking is needed.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from bns.approaches.parts.base import Option, Options, Setting
from bns.approaches.parts.model_population import ModelPopulation
from bns.approaches.parts.physical import Physical
from bns.approaches.parts.physics_models import ModelSpace
from bns.physics.model import Model
from bns.robots.base import TwoWheeled


class BackToReality(Physical):
    """Controllers and simulators by turns."""

    options: ClassVar[Options] = {
        "models": Option(16, 2, 10_000, "simulators in their population"),
        "generations": Option(4, 1, 10_000, "generations of simulators after each drive"),
        "memory": Option(10, 1, 100_000, "latest drives that simulators are judged by"),
    }

    def __init__(self, setting: Setting, robot: TwoWheeled, space: ModelSpace) -> None:
        """Simulators around the drawing."""
        super().__init__(setting, robot, space)
        self.models = ModelPopulation(space, setting.whole("models"), setting.generator(0))

    def pick(self, evaluation: int) -> np.ndarray:
        """Step 2: not always the fittest, so that simulators are judged by different ones."""
        return self.plan(self.evolver.pick(evaluation))

    def advance(self) -> None:
        """Steps 3 and 1."""
        if len(self.drives):
            with self.timed("training_cpu_s"):
                random = self.setting.generator(len(self.drives))
                self.models.judge(self._difference)
                for _ in range(self.setting.whole("generations")):
                    self.models.breed(self._difference, random)
                self.use(self.models.best)
        self.evolve()

    def _difference(self, model: Model) -> float:
        """Equation 2.10."""
        return self.drives.fitness_error(model, min(self.setting.whole("memory"), len(self.drives)))


APPROACH = BackToReality
