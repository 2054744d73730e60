"""What approaches on physics models have in common: two wheels, the drawing to begin with, and what was driven."""

from __future__ import annotations

from typing import Self, cast

import numpy as np

from bns.approaches.parts.base import Setting
from bns.approaches.parts.evolving import Evolving
from bns.approaches.parts.physics_models import COMMON, Drives, ModelSpace
from bns.bootstrap.simulators import PhysicsSimulator
from bns.errors import SpecError
from bns.physics.model import Model
from bns.robots.base import TwoWheeled


class Physical(Evolving):
    """Begins on the robot's drawing, in which no effect is on: what the world hides costs it what that costs."""

    effects: tuple[str, ...] = COMMON

    def __init__(self, setting: Setting, robot: TwoWheeled, space: ModelSpace) -> None:
        """On the drawing, with nothing driven."""
        super().__init__(setting, PhysicsSimulator(robot, setting.task, space.drawing))
        self.robot, self.space, self.drives = robot, space, Drives(robot, setting.task)

    @classmethod
    def start(cls, setting: Setting) -> Self:
        """SpecError for a robot without two wheels."""
        if not setting.robot.two_wheeled:
            raise SpecError(
                f"the approach {setting.spec.approach} has a physics model of two wheels, and the {setting.robot.name} has none; "
                "take one of bns, precomputed, on-robot, then-on-robot."
            )
        robot = cast(TwoWheeled, setting.robot)
        return cls(setting, robot, ModelSpace.of(robot, cls.effects))

    def pick(self, evaluation: int) -> np.ndarray:
        """The fittest on the model."""
        return self.plan(self.fittest())

    def learn(self, commands: np.ndarray, poses: np.ndarray, evaluation: int) -> None:
        """Keep the drive."""
        self.drives.add(commands, poses)

    def use(self, model: Model) -> None:
        """Evolve on this model from now on."""
        self.simulator = PhysicsSimulator(self.robot, self.setting.task, model)
