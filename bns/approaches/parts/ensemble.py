"""Several networks for each displacement, and what evolution makes of them when they disagree.

They learn from the same drives, begin with other weights, and each sees every pattern as often as a Poisson draw of mean 1
says: a bootstrap of rows that can be drawn while rows arrive (Oza and Russell, "Online bagging and boosting", 2001).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import factorial

import numpy as np

from bns.approaches.parts.base import Setting
from bns.bootstrap.simulators import Simulator
from bns.bootstrap.trainer import Known, Trainer
from bns.engine.evolution import Population
from bns.engine.philox import Purpose, uniforms
from bns.engine.snn import side_by_side
from bns.robots.base import RandomStream, Scores

USES = ("mean", "worst", "sampled")
_POISSON = np.cumsum([np.exp(-1.0) / factorial(k) for k in range(10)])


class Ensemble:
    """Trainers that share their patterns: together a `bns.bootstrap.trainer.Learner`, whose networks are the members' mean."""

    def __init__(self, setting: Setting, members: list[Trainer]) -> None:
        """Members as they are; the first one's patterns are everybody's."""
        self._setting = setting
        self.data = members[0].data
        self.members = [replace(member, data=self.data) for member in members]
        self.times = np.empty((len(members), 0), np.float32)
        """How often each pattern counts for each member, (members, patterns)."""

    @classmethod
    def start(cls, setting: Setting, size: int, known: Known | None = None) -> Ensemble:
        """Untrained networks; the first member's are those that a run without an ensemble begins with."""
        keys = [setting.key, *(setting.own_key(f"network {number}") for number in range(1, size))]
        return cls(setting, [Trainer.start(setting.robot, key, setting.spec, known) for key in keys])

    @property
    def failures(self) -> int:
        """Of all members."""
        return sum(member.failures for member in self.members)

    def add(self, commands: np.ndarray, poses: np.ndarray, evaluation: int) -> None:
        """Split into training and validation as without an ensemble; then each member's own draws."""
        self.members[0].add(commands, poses, evaluation)
        new = self.data.training.count - self.times.shape[1]
        draws = [uniforms(member.key, Purpose.APPROACH, evaluation, 1, new)[0, :, 0] for member in self.members]
        times = np.searchsorted(_POISSON, np.array(draws).reshape(len(draws), new), side="right")
        self.times = np.hstack([self.times, times.astype(np.float32)])

    def forget(self, keep: int) -> None:
        """Drop what all members learned from, but for the latest drives."""
        self.members[0].forget(keep)
        self.times = self.times[:, self.times.shape[1] - self.data.training.count :]

    def restart(self) -> None:
        """All members."""
        for member in self.members:
            member.restart()

    def train(self) -> None:
        """Every member, on its own rows."""
        for member, times in zip(self.members, self.times, strict=True):
            member.train(times)

    def networks(self) -> list[np.ndarray]:
        """Copies of the members' networks, (networks, W) each."""
        return [member.evolution_weights() for member in self.members]

    def evolution_weights(self) -> np.ndarray:
        """Networks (networks, W) that say the mean of what the members say."""
        return side_by_side(self.networks(), 1 / len(self.members))

    def errors(self) -> tuple[float, float]:
        """Means of the members' errors; that of their mean is smaller."""
        training, validation = zip(*(member.errors() for member in self.members), strict=True)
        return float(np.mean(training)), float(np.mean(validation))

    def drawn(self, round_: int) -> np.ndarray:
        """The networks of one member, drawn for this round."""
        draw = uniforms(self._setting.key, Purpose.APPROACH, round_, 2, 1)[1, 0, 1]
        return self.members[int(draw * len(self.members))].evolution_weights()


@dataclass(frozen=True)
class WorstSimulator:
    """A controller is as fit as the member says that thinks least of it; paths are those of the members' mean."""

    members: tuple[Simulator, ...]
    mean: Simulator
    foretells: bool = True

    def score(self, population: Population, stream: RandomStream | None = None, parents: Scores | None = None) -> Scores:
        """By all members; where a robot says what networks said, the members' outputs stand below one another."""
        known: list[Scores | None] = [None] * len(self.members)
        if parents is not None and parents.outputs is not None:
            known = [parents._replace(outputs=part) for part in np.split(parents.outputs, len(self.members))]
        each = [
            member.score(population, stream, before) for member, before in zip(self.members, known, strict=True)
        ]
        fitness = np.array([one.fitness for one in each])
        who, everybody = np.argmin(fitness, axis=0), np.arange(len(population))

        def of_worst(values: list[np.ndarray]) -> np.ndarray:
            return np.array(values)[who, everybody]

        used = [one.used for one in each if one.used is not None]
        outputs = [one.outputs for one in each if one.outputs is not None]
        worst = of_worst([one.fitness for one in each])
        return Scores(
            worst,
            of_worst([one.goals_reached for one in each]),
            int((worst == 0).sum()),
            of_worst(used) if used else None,
            np.vstack(outputs) if outputs else None,
        )

    def plan(self, controller: np.ndarray, stream: RandomStream | None = None) -> np.ndarray:
        """As the mean has it."""
        return self.mean.plan(controller, stream)

    def poses(self, commands: np.ndarray) -> np.ndarray:
        """As the mean has it."""
        return self.mean.poses(commands)
