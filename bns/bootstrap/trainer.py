"""The training networks of one run: what they learn from, and what happens when their arithmetic fails."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from bns.engine.patterns import PatternSet, TrainingData
from bns.engine.philox import Key
from bns.engine.rprop import Rprop
from bns.engine.snn import INPUTS, PER_NEURON, initial_weights, predict
from bns.robots.base import Robot
from bns.spec import RunSpec


def untrained(robot: Robot, key: Key) -> np.ndarray:
    """The networks that a robot's training begins with (networks, W)."""
    return initial_weights(key, len(robot.networks), robot.hidden, robot.input_count, robot.nguyen_widrow)


Known = Callable[[np.ndarray], np.ndarray]
"""Displacements (n, networks), SI, of commands (n, components)."""


def _beginning(robot: Robot, key: Key, known: Known | None) -> np.ndarray:
    """Untrained networks, which say 0 where they only add to what is known."""
    weights = untrained(robot, key)
    if known:
        weights[:, PER_NEURON - 1 :: PER_NEURON] = 0
        weights[:, -1] = 0
    return weights


class Learner(Protocol):
    """What learns from drives: a `Trainer`, or several as one."""

    data: TrainingData

    @property
    def failures(self) -> int:
        """How often arithmetic failed."""

    def add(self, commands: np.ndarray, poses: np.ndarray, evaluation: int) -> None:
        """Take in what the robot did, as `Trainer.add`."""

    def train(self) -> None:
        """One round on all training patterns."""

    def forget(self, keep: int) -> None:
        """Drop the patterns of all drives but the latest so many."""

    def restart(self) -> None:
        """Begin with untrained networks again."""

    def evolution_weights(self) -> np.ndarray:
        """A copy of the networks (networks, W) for evolution to work on."""

    def errors(self) -> tuple[float, float]:
        """Mean squared errors on training and on validation patterns."""


@dataclass
class Trainer:
    """Networks under training and the patterns gathered so far."""

    robot: Robot
    key: Key
    iterations: int
    rule: Rprop
    data: TrainingData
    failures: int = 0
    known: Known | None = None
    """What is known of commands without networks: these learn the rest, and begin with no rest."""
    drives: list[tuple[int, int]] = field(default_factory=list)
    """Training and validation patterns of each drive that is remembered."""

    @classmethod
    def start(cls, robot: Robot, key: Key, spec: RunSpec, known: Known | None = None) -> Trainer:
        """Untrained networks and no patterns."""
        weights = _beginning(robot, key, known)
        return cls(
            robot,
            key,
            spec.training_iterations_per_evaluation,
            Rprop.start(weights, spec.training_algorithm, robot.sigmoid_output, robot.flat_spot),
            TrainingData.empty(INPUTS, len(robot.networks)),
            known=known,
        )

    def add(self, commands: np.ndarray, poses: np.ndarray, evaluation: int) -> None:
        """Take in what the robot did: measured poses (m, columns) of its commands (n, components), m <= n."""
        moved = self.robot.measured_displacements(poses)
        rest = moved - self.known(commands[: len(poses)]) if self.known else moved
        before = self.data.training.count, self.data.validation.count
        self.failures += self.data.add(
            self.robot.inputs(commands)[:, : len(poses)],
            self.robot.targets(rest),
            self.key,
            evaluation,
            self.robot.learnable(moved),
        )
        self.drives.append((self.data.training.count - before[0], self.data.validation.count - before[1]))

    def forget(self, keep: int) -> None:
        """Drop the patterns of all drives but the latest so many."""
        old, self.drives = self.drives[:-keep], self.drives[-keep:]
        self.data.training.forget(sum(training for training, _ in old))
        self.data.validation.forget(sum(validation for _, validation in old))

    def restart(self) -> None:
        """Begin with untrained networks again."""
        for net, weights in enumerate(_beginning(self.robot, self.key, self.known)):
            self.rule.restart(net, weights)

    def train(self, times: np.ndarray | None = None) -> None:
        """Iterate on all training patterns. A network that is no longer finite is initialised again, and counted.

        ``times`` (patterns,): how often each of them counts, where not all count once.
        """
        patterns = self.data.training if times is None else self.data.training.counted(times)
        if self.robot.repeats_inputs or times is not None:
            for net, (inputs, targets, counts) in enumerate(patterns.merged()):
                self.rule.train_one(net, inputs, targets, counts, len(targets), self.iterations)
        else:
            self.rule.train(patterns.inputs, patterns.targets, patterns.count, self.iterations)
        for failed in np.flatnonzero(~np.isfinite(self.rule.weights).all(axis=1)):
            self.failures += 1
            self.rule.restart(int(failed), _beginning(self.robot, self.key, self.known)[failed])

    def evolution_weights(self) -> np.ndarray:
        """A copy of the networks for evolution to work on."""
        return self.rule.weights.copy()

    def errors(self) -> tuple[float, float]:
        """Mean squared error of the normalised outputs on training and on validation patterns; NaN while there are none."""
        return self._error(self.data.training), self._error(self.data.validation)

    def _error(self, patterns: PatternSet) -> float:
        if patterns.count == 0:
            return float("nan")
        outputs = predict(self.rule.weights, patterns.inputs[:, : patterns.count], self.robot.sigmoid_output)
        squared = (outputs.astype(np.float64) - patterns.targets[:, : patterns.count]) ** 2
        return float(np.mean(squared[patterns.present[:, : patterns.count]]))
