"""What the robot has done so far, as training and validation patterns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bns.engine.philox import Key, Purpose, uniforms

TRAINING_SHARE = 0.75
"""Each pattern goes to training with this probability, else to validation, which only watches (section 4.2.3)."""


@dataclass
class PatternSet:
    """Inputs (inputs, capacity) and targets (networks, capacity), float32, of which the first `count` columns are in use."""

    inputs: np.ndarray
    targets: np.ndarray
    count: int = 0

    @classmethod
    def empty(cls, inputs: int, networks: int) -> PatternSet:
        """No patterns yet."""
        return cls(np.zeros((inputs, 256), np.float32), np.zeros((networks, 256), np.float32))

    def add(self, inputs: np.ndarray, targets: np.ndarray) -> None:
        """Append columns (inputs, n) and (networks, n)."""
        new = self.count + inputs.shape[1]
        while new > self.inputs.shape[1]:
            self.inputs = np.concatenate([self.inputs, np.zeros_like(self.inputs)], axis=1)
            self.targets = np.concatenate([self.targets, np.zeros_like(self.targets)], axis=1)
        self.inputs[:, self.count : new] = inputs
        self.targets[:, self.count : new] = targets
        self.count = new


@dataclass
class TrainingData:
    """The training set and the validation set of one run."""

    training: PatternSet
    validation: PatternSet

    @classmethod
    def empty(cls, inputs: int, networks: int) -> TrainingData:
        """No patterns yet."""
        return cls(PatternSet.empty(inputs, networks), PatternSet.empty(inputs, networks))

    def add(self, inputs: np.ndarray, targets: np.ndarray, key: Key, evaluation: int) -> int:
        """Split the patterns of one evaluation at random; patterns that are not finite are left out and counted."""
        finite = np.isfinite(inputs).all(axis=0) & np.isfinite(targets).all(axis=0)
        to_training = uniforms(key, Purpose.SPLIT, evaluation, 1, inputs.shape[1])[0, :, 0] < TRAINING_SHARE
        for patterns, chosen in ((self.training, finite & to_training), (self.validation, finite & ~to_training)):
            patterns.add(inputs[:, chosen], targets[:, chosen])
        return int((~finite).sum())
