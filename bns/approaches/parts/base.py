"""What the loop asks of an approach, and what a run gives it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from bns.bootstrap.evolver import Generation
from bns.bootstrap.simulators import Simulator
from bns.engine.philox import Key, Purpose
from bns.options import Choice, Option, Options
from bns.robots.base import Robot
from bns.spec import RunSpec
from bns.tasks import Task

__all__ = ["Approach", "Choice", "Option", "Options", "Setting"]


@dataclass(frozen=True)
class Setting:
    """What a run gives its approach: robot, task, draws, parameters, and the values of the approach's options."""

    robot: Robot
    task: Task
    key: Key
    spec: RunSpec
    options: Mapping[str, float | str]

    def number(self, name: str) -> float:
        """An option that is a number."""
        return float(self.options[name])

    def whole(self, name: str) -> int:
        """An option that is a whole number."""
        return int(self.options[name])

    def chosen(self, name: str) -> str:
        """An option that is a word, or a file."""
        return str(self.options[name])

    def share(self, name: str) -> int:
        """So many of the run's evaluations as an option's share says: one at least, and one is left at least if there are two."""
        evaluations = self.spec.evaluations
        return max(1, min(round(self.number(name) * evaluations), evaluations - 1))

    def generator(self, step: int) -> np.random.Generator:
        """Draws of the approach's own, apart from all others, for each step anew."""
        counter = np.array([0, 0, step, Purpose.APPROACH], np.uint64)
        return np.random.Generator(
            np.random.Philox(counter=counter, key=np.array([self.key.seed, self.key.study], np.uint64))
        )

    def own_key(self, what: str) -> Key:
        """A key for draws of controllers that are nobody else's."""
        return Key.of_run(self.spec.seed, self.spec.root_seed, self.robot.name, f"{self.task.name}, {what}")


class Approach(Protocol):
    """Learns from drives and picks the next.

    The loop calls, evaluation by evaluation: ``pick``, then (the robot drives) ``learn``, then ``advance``. On a robot that takes
    its time ``advance`` is called during the drive, before ``learn``, in another thread and as often as there is time.
    """

    options: ClassVar[Options]
    networked: ClassVar[bool]
    """Has it networks that can be kept?"""
    simulator: Simulator
    """What foretells drives now; replaced as the approach learns."""
    weights: np.ndarray
    """Its networks (networks, W); (0, 0) where it has none."""

    @classmethod
    def start(cls, setting: Setting) -> Self:
        """At the beginning of a run, with nothing driven. SpecError for a setting that it cannot take."""

    def pick(self, evaluation: int) -> np.ndarray:
        """The commands (n, components) to be driven next."""

    def learn(self, commands: np.ndarray, poses: np.ndarray, evaluation: int) -> None:
        """Take in what a drive measured: poses (m, columns) of commands (n, components), m <= n."""

    def advance(self) -> None:
        """One round of all that goes on between two drives."""

    def plan(self, controller: np.ndarray, generation: int | None = None) -> np.ndarray:
        """What is driven of a controller of this generation, or of an earlier one of this round."""

    def fittest(self) -> np.ndarray:
        """The best controller (n, components) that it has now, as far as it knows."""

    def measures(self) -> dict[str, Any]:
        """Columns of evals that only the approach knows, as in `bns.approaches.parts.evolving.Evolving.measures`."""

    @property
    def history(self) -> Sequence[Generation]:
        """The generations of the last round, where the spec records them."""

    @property
    def learned_from(self) -> np.ndarray:
        """Inputs (inputs, patterns) of what networks were trained on."""
