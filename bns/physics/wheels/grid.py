"""The time grid of a batch of trials: commands back to back, cut into steps of at most dt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.physics.signals import Array


@dataclass(frozen=True)
class Grid:
    """Steps of every trial, padded at the end with steps of length 0.

    step_s, left_m_s, right_m_s: (batch, steps); node_s: (batch, steps + 1), the time of each step's two ends;
    ends: (batch, commands), the node at which each command ends.
    """

    step_s: Array
    node_s: Array
    left_m_s: Array
    right_m_s: Array
    ends: NDArray[np.int64]


def step_grid(left_m_s: Array, right_m_s: Array, duration_s: Array, dt_s: float, growth: float = 1.0) -> Grid:
    """Cut commands, (batch, commands) each, into steps of ``dt_s`` and one shorter step for what remains.

    The remainder, not equal steps: results then change smoothly with a command's duration. With a ``growth`` above 1 each step
    of a command is that many times as long as the one before: short where speeds still change, long where they have settled.
    """
    steps = int(np.ceil(_how_many(float(duration_s.max(initial=0.0)) / dt_s, growth))) + 1
    lengths, edges = dt_s * growth ** np.arange(float(steps)), dt_s * _summed(growth, steps)
    # a duration of 340 steps must not become 341 because 0.005 has no exact binary form
    counts = np.searchsorted(edges, duration_s - 1e-9 * dt_s).astype(np.int64)
    counts = np.where(duration_s > 0, np.maximum(counts, 1), 0)
    ends = np.cumsum(counts, axis=1)
    total = counts.sum(axis=1)
    width = int(total.max(initial=0))
    valid = np.arange(width) < total[:, None]
    step_s = np.zeros(valid.shape)
    step_s[valid] = lengths[np.arange(total.sum()) - np.repeat(np.cumsum(counts) - counts.ravel(), counts.ravel())]
    rows, commands = np.nonzero(counts)
    step_s[rows, ends[rows, commands] - 1] = (duration_s - edges[np.maximum(counts - 1, 0)])[rows, commands]
    left, right = (_spread(speed, counts, valid) for speed in (left_m_s, right_m_s))
    return Grid(step_s, np.pad(np.cumsum(step_s, axis=1), ((0, 0), (1, 0))), left, right, ends)


def _how_many(firsts: float, growth: float) -> float:
    """How many steps last as long as so many of the first one."""
    return firsts if growth == 1.0 else float(np.log1p(firsts * (growth - 1.0)) / np.log(growth))


def _summed(growth: float, steps: int) -> Array:
    """How long 0, 1, ... steps last together, in units of the first."""
    number = np.arange(steps + 1.0)
    summed: Array = number if growth == 1.0 else (growth**number - 1.0) / (growth - 1.0)
    return summed


def _spread(values: Array, counts: NDArray[np.int64], valid: NDArray[np.bool_]) -> Array:
    """One value a command -> one value a step, 0 in the padding."""
    out = np.zeros(valid.shape)
    out[valid] = np.repeat(values.ravel(), counts.ravel())
    return out
