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
    edges = _edges(float(duration_s.max(initial=0.0)), dt_s, growth)
    # a duration of 340 steps must not become 341 because 0.005 has no exact binary form
    counts = np.ceil(duration_s / dt_s - 1e-9).astype(np.int64) if edges is None else _counted(edges, duration_s, dt_s)
    counts = np.where(duration_s > 0, np.maximum(counts, 1), 0)
    ends = np.cumsum(counts, axis=1)
    total = counts.sum(axis=1)
    width = int(total.max(initial=0))
    valid = np.arange(width) < total[:, None]
    rows, commands = np.nonzero(counts)
    if edges is None:
        step_s, begun_s = np.where(valid, dt_s, 0.0), (counts - 1) * dt_s
    else:
        step_s, begun_s = np.zeros(valid.shape), edges[np.maximum(counts - 1, 0)]
        within = np.arange(total.sum()) - np.repeat(np.cumsum(counts.ravel()) - counts.ravel(), counts.ravel())
        step_s[valid] = np.diff(edges)[within]
    step_s[rows, ends[rows, commands] - 1] = (duration_s - begun_s)[rows, commands]
    left, right = (_spread(speed, counts, valid) for speed in (left_m_s, right_m_s))
    return Grid(step_s, np.pad(np.cumsum(step_s, axis=1), ((0, 0), (1, 0))), left, right, ends)


def _edges(longest_s: float, dt_s: float, growth: float) -> Array | None:
    """When the steps of a command end, from 0 to beyond the longest one; None where all are alike."""
    if growth == 1.0:
        return None
    steps = int(np.ceil(np.log1p(longest_s / dt_s * (growth - 1.0)) / np.log(growth))) + 1
    edges: Array = dt_s * (growth ** np.arange(steps + 1.0) - 1.0) / (growth - 1.0)
    return edges


def _counted(edges: Array, duration_s: Array, dt_s: float) -> NDArray[np.int64]:
    return np.searchsorted(edges, duration_s - 1e-9 * dt_s).astype(np.int64)


def _spread(values: Array, counts: NDArray[np.int64], valid: NDArray[np.bool_]) -> Array:
    """One value a command -> one value a step, 0 in the padding."""
    out = np.zeros(valid.shape)
    out[valid] = np.repeat(values.ravel(), counts.ravel())
    return out
