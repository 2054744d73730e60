"""A two-wheeled robot as a physics world: its model with effects switched on, integrated at a fine time step."""

from __future__ import annotations

from typing import cast

import numpy as np

from bns.engine.philox import Key, Purpose, normals
from bns.errors import ModelError
from bns.physics.model import Model, load_model
from bns.physics.wheels.differential_drive import observe, simulate
from bns.robots.base import Robot, TwoWheeled


class KheperaPhysics:
    """Drives a model of two wheels; motor jitter and tracking noise are drawn for every command."""

    repeatable = True
    renderable = False

    def __init__(self, robot: TwoWheeled, model: Model) -> None:
        self._robot = robot
        self._model = model
        x_m, y_m, heading_rad = (float(v) for v in robot.start_pose()[0])
        self._start = (x_m, y_m, heading_rad)
        self.digest = "w" + model.digest[:15]

    def drive(self, commands: np.ndarray, key: Key, purpose: Purpose, step: int) -> np.ndarray:
        """Tracked poses at the end of each command, headings not wrapped."""
        left, right, duration = self._robot.wheel_speeds_m_s(commands.astype(np.float64))
        draws = normals(key, purpose, step, 2, len(commands))
        driven = simulate(self._model, left[None], right[None], duration[None], start=self._start, normals=draws[:1, :, :2])
        return observe(driven, draws[1:, :, :3], self._model)[0]


def build(robot: Robot, model: str | None = None) -> KheperaPhysics:
    """The model of the robot's world, as shipped, or the one of a file."""
    if not robot.two_wheeled:
        raise ModelError(f"robot {robot.name} has no two wheels, and this physics world drives two; declare another physics.")
    wheeled = cast(TwoWheeled, robot)
    return KheperaPhysics(wheeled, load_model(model or wheeled.world_model))
