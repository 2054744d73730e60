"""What the robot has done so far, as training and validation patterns."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bns.engine.philox import Key, Purpose, uniforms

TRAINING_SHARE = 0.75
"""Each pattern goes to training with this probability, else to validation, which only watches (section 4.2.3)."""


@dataclass
class PatternSet:
    """Inputs (inputs, capacity) and targets (networks, capacity), float32, of which the first `count` columns are in use.

    `present` (networks, capacity) says which network may learn from which pattern.
    """

    inputs: np.ndarray
    targets: np.ndarray
    count: int = 0
    present: np.ndarray = field(default_factory=lambda: np.empty((0, 0), bool))

    def __post_init__(self) -> None:
        if self.present.shape != self.targets.shape:
            self.present = np.ones(self.targets.shape, bool)

    @classmethod
    def empty(cls, inputs: int, networks: int) -> PatternSet:
        """No patterns yet."""
        return cls(np.zeros((inputs, 256), np.float32), np.zeros((networks, 256), np.float32))

    def add(self, inputs: np.ndarray, targets: np.ndarray, present: np.ndarray | None = None) -> None:
        """Append columns (inputs, n) and (networks, n); without ``present`` (networks, n) every network learns from all."""
        new = self.count + inputs.shape[1]
        while new > self.inputs.shape[1]:
            self.inputs = np.concatenate([self.inputs, np.zeros_like(self.inputs)], axis=1)
            self.targets = np.concatenate([self.targets, np.zeros_like(self.targets)], axis=1)
            self.present = np.concatenate([self.present, np.ones_like(self.present)], axis=1)
        self.inputs[:, self.count : new] = inputs
        self.targets[:, self.count : new] = targets
        self.present[:, self.count : new] = True if present is None else present
        self.count = new

    def forget(self, first: int) -> None:
        """Drop the first so many patterns."""
        left = self.count - first
        for kept in (self.inputs, self.targets, self.present):
            kept[:, :left] = kept[:, first : self.count].copy()
        self.count = left

    def in_use(self) -> np.ndarray:
        """A copy of the inputs so far, (inputs, count)."""
        return self.inputs[:, : self.count].copy()

    def counted(self, times: np.ndarray) -> PatternSet:
        """The same patterns, each to be learned from as if it had been seen so many times (count,): 0 leaves it out."""
        present = self.present.astype(np.float32)
        present[:, : self.count] *= times
        return PatternSet(self.inputs, self.targets, self.count, present)

    def merged(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """For each network its distinct patterns: inputs (inputs, m), mean target (m,), how many each stands for (m,); float32.

        The sum of squared errors over patterns of the same input differs from that of their mean by a constant: the
        gradient is the same.
        """
        X = np.ascontiguousarray(self.inputs[:, : self.count].T)
        distinct, group = np.unique(X.view(f"V{X.itemsize * X.shape[1]}").ravel(), return_inverse=True)
        columns = distinct.view(np.float32).reshape(-1, X.shape[1]).T
        merged = []
        for target, present in zip(self.targets[:, : self.count], self.present[:, : self.count], strict=True):
            counts = np.bincount(group, present, len(distinct))
            sums = np.bincount(group, present * target.astype(np.float64), len(distinct))
            seen = counts > 0
            means = sums[seen] / counts[seen]
            merged.append((np.ascontiguousarray(columns[:, seen]), means.astype(np.float32), counts[seen].astype(np.float32)))
        return merged


@dataclass
class TrainingData:
    """The training set and the validation set of one run."""

    training: PatternSet
    validation: PatternSet

    @classmethod
    def empty(cls, inputs: int, networks: int) -> TrainingData:
        """No patterns yet."""
        return cls(PatternSet.empty(inputs, networks), PatternSet.empty(inputs, networks))

    def add(
        self, inputs: np.ndarray, targets: np.ndarray, key: Key, evaluation: int, present: np.ndarray | None = None
    ) -> int:
        """Split the patterns of one evaluation at random; patterns that are not finite are left out and counted."""
        finite = np.isfinite(inputs).all(axis=0) & np.isfinite(targets).all(axis=0)
        to_training = uniforms(key, Purpose.SPLIT, evaluation, 1, inputs.shape[1])[0, :, 0] < TRAINING_SHARE
        for patterns, chosen in ((self.training, finite & to_training), (self.validation, finite & ~to_training)):
            patterns.add(inputs[:, chosen], targets[:, chosen], None if present is None else present[:, chosen])
        return int((~finite).sum())
