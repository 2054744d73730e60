"""Who drives the controllers that the loop picks: a world that answers at once, or a robot that takes its time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from bns.engine.philox import Key, Purpose
from bns.worlds.base import World


@dataclass(frozen=True)
class Drive:
    """What a controller became in the world.

    commands (n, components): those carried out, in the robot's units; poses (m, columns), m <= n: measured at the end
    of each, in the task's frame; rounds: how many rounds of training and evolution went on meanwhile (0: one is due now).
    """

    commands: np.ndarray
    poses: np.ndarray
    rounds: int = 0
    skipped: bool = False
    """Somebody passed over this evaluation: nothing is learned from it, and it has no row."""


class Driver(Protocol):
    """Drives one controller after the other."""

    @property
    def finished(self) -> bool:
        """Whether the run ends before its evaluations are used up."""

    def drive(self, evaluation: int, controller: np.ndarray, advance: Callable[[], None]) -> Drive:
        """Drive a controller (n, components).

        `advance` does one round of training and evolution. A driver that takes time repeats it meanwhile, in one other
        thread, whole rounds only.
        """

    def evaluated(self, evaluation: int, drive: Drive, row: Mapping[str, Any]) -> None:
        """An evaluation is complete; `row` is its row of the table `evals`."""


class WorldDriver:
    """The world answers at once; nothing goes on meanwhile, so that the same spec gives the same numbers anywhere."""

    finished = False

    def __init__(self, world: World, key: Key) -> None:
        self._world, self._key = world, key

    def drive(self, evaluation: int, controller: np.ndarray, advance: Callable[[], None]) -> Drive:
        """Ask the world."""
        return Drive(controller, self._world.drive(controller, self._key, Purpose.WORLD_EVALUATED, evaluation))

    def evaluated(self, evaluation: int, drive: Drive, row: Mapping[str, Any]) -> None:
        """Nothing is to be noted."""
