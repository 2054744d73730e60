"""The substitute world: a static simulator trained beforehand, plus Gaussian noise (section 4.5)."""

from __future__ import annotations

import numpy as np

from bns.engine.philox import Key, Purpose, normals
from bns.engine.snn import predict
from bns.robots.base import Robot
from bns.robots.simulator import load_static_simulator


class SubstituteWorld:
    """Displacements of the static simulator, disturbed with the standard deviations of its residuals."""

    repeatable = True
    renderable = False

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._simulator = load_static_simulator(robot.name)
        self.digest = self._simulator.digest

    def drive(self, commands: np.ndarray, key: Key, purpose: Purpose, step: int) -> np.ndarray:
        """Poses at the end of each command; one independent draw a command and network."""
        outputs = predict(self._simulator.weights, self._robot.inputs(commands), self._robot.sigmoid_output)
        displacements = self._robot.displacements(outputs)
        blocks = -(-displacements.shape[1] // 4)
        noise = np.hstack(list(normals(key, purpose, step, blocks, len(commands))))[:, : displacements.shape[1]]
        return self._robot.poses(displacements + noise * self._simulator.noise_sd, commands)


def build(robot: Robot) -> SubstituteWorld:
    """The substitute world of a robot."""
    return SubstituteWorld(robot)
