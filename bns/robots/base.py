"""What the loop asks of a robot."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from bns.engine.evolution import CommandBounds, Population
from bns.engine.philox import Key
from bns.tasks import Task


class Scores(NamedTuple):
    """Per controller: fitness (n,), 0 where the arithmetic failed; goals reached (n,); how many failed."""

    fitness: np.ndarray
    goals_reached: np.ndarray
    failures: int


class Robot(Protocol):
    """A robot's commands, their bounds, its networks' inputs and outputs, and its fitness."""

    name: str
    networks: tuple[str, ...]
    hidden: int
    radii_m: tuple[float, ...]
    bounds: CommandBounds
    command_columns: tuple[str, ...]

    def initial_population(self, key: Key, size: int, shortest: int, capacity: int) -> Population:
        """A random population."""

    def random_controllers(self, key: Key, count: int, length: int) -> Population:
        """Random controllers that all have the same number of commands."""

    def inputs(self, commands: np.ndarray) -> np.ndarray:
        """Normalised network inputs (inputs, n) float32 of one controller's commands (n, components)."""

    def displacements(self, outputs: np.ndarray) -> np.ndarray:
        """Displacements (n, networks), SI, in the robot's frame, of network outputs (networks, n)."""

    def targets(self, displacements: np.ndarray) -> np.ndarray:
        """The inverse of `displacements`: network targets (networks, n) float32."""

    def poses(self, displacements: np.ndarray) -> np.ndarray:
        """Poses (n, 3) after each displacement, from the start of every task."""

    def measured_displacements(self, poses: np.ndarray) -> np.ndarray:
        """Displacements (n, networks) between measured poses (n, 3), the first from the start."""

    def score(self, population: Population, weights: np.ndarray, task: Task) -> Scores:
        """Fitness of every controller on simulator networks (networks, W)."""

    def judge(self, poses: np.ndarray, task: Task) -> tuple[float, int]:
        """Fitness and goals reached of one driven path (n, 3)."""

    def successes(self, poses: np.ndarray, task: Task) -> tuple[bool, ...]:
        """Whether the path visits all goals in order, for each of `radii_m`."""

    def driven_ms(self, commands: np.ndarray) -> float:
        """How long these commands drive, in milliseconds."""
