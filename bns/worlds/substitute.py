"""The substitute world: a static simulator trained beforehand, plus Gaussian noise (section 4.5)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.engine.philox import Key, Purpose, normals
from bns.engine.snn import predict
from bns.robots.base import Robot
from bns.robots.simulator import StaticSimulator, load_static_simulator


def disturbed(simulator: StaticSimulator, sd_m: float | None) -> StaticSimulator:
    """The simulator with noise of ``sd_m`` on every displacement; with its own where that is None."""
    if sd_m is None:
        return simulator
    return replace(simulator, noise_sd=np.where(simulator.noise_sd > 0, sd_m, 0.0))


class SubstituteWorld:
    """Displacements of the static simulator, disturbed with the standard deviations that it names."""

    repeatable = True
    renderable = False

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._simulator = disturbed(load_static_simulator(robot.name), robot.substitute_sd_m)
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
