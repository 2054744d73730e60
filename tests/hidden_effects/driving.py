"""What the robots are told: random commands of two wheels, trial by trial, over a session."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FRAME_S = 0.04
SESSION_S = 1500.0
"""Sessions last about as long whatever the number of trials: the pauses fill them."""


@dataclass(frozen=True)
class Robot:
    """A nominal robot, and how the product is told of it."""

    wheelbase_m: float
    slowest_m_s: float
    fastest_m_s: float
    arguments: tuple[str, ...]


ROBOTS = {
    "khepera": Robot(0.0884, 0.0208, 0.208, ("--model", "khepera")),
    "wide": Robot(0.20, 0.05, 0.5, ("--model", "differential-drive", "--wheelbase", "0.2")),
    "tiny": Robot(0.05, 0.012, 0.12, ("--model", "differential-drive", "--wheelbase", "0.05")),
    "large": Robot(0.4, 0.09, 0.9, ("--model", "differential-drive", "--wheelbase", "0.4")),
    "vehicle": Robot(1.5, 0.3, 2.5, ("--model", "differential-drive", "--wheelbase", "1.5")),
}


@dataclass(frozen=True)
class Driving:
    """Commands of n trials: wheels (n, k, 2) in m/s, edges (n, k + 1) in s; unused commands last no time.

    `start` (n, 3) holds x, y (m) and heading (rad), `session_s` (n,) when each trial began.
    """

    wheels_m_s: np.ndarray
    edges_s: np.ndarray
    counts: np.ndarray
    start: np.ndarray
    session_s: np.ndarray

    @property
    def ends_s(self) -> np.ndarray:
        """(n,) end of the last command."""
        return self.edges_s[:, -1]


def drive(rng: np.random.Generator, robot: Robot, plan: str, trials: int, grid_s: float) -> Driving:
    """Random trials; command changes fall on multiples of `grid_s`."""
    counts = rng.integers(4, 14, trials)
    most = int(counts.max())
    lasts = np.round(rng.uniform(0.4, 3.0, (trials, most)) / grid_s) * grid_s
    lasts[np.arange(most) >= counts[:, None]] = 0.0
    edges = np.concatenate([np.zeros((trials, 1)), np.cumsum(lasts, axis=1)], axis=1)
    wheels = rng.uniform(robot.slowest_m_s, robot.fastest_m_s, (trials, most, 2)) * PLANS[plan](rng, trials, most)
    start = np.column_stack([rng.uniform(0.0, 1.6, trials), rng.uniform(-0.2, 1.2, trials), rng.uniform(-3, 3, trials)])
    return Driving(wheels, edges, counts, start, _session(rng, edges[:, -1]))


def _session(rng: np.random.Generator, ends_s: np.ndarray) -> np.ndarray:
    pause = max(2.0, (SESSION_S - ends_s.sum()) / len(ends_s))
    lasts = ends_s + pause * rng.uniform(0.7, 1.3, len(ends_s))
    return np.round(np.concatenate([[0.0], np.cumsum(lasts)[:-1]]), 2)


def _forward(rng: np.random.Generator, trials: int, most: int) -> np.ndarray:
    return np.ones((trials, most, 2))


def _mixed(rng: np.random.Generator, trials: int, most: int) -> np.ndarray:
    """Six in ten forward; the rest reversing, spinning either way, and now and then standing."""
    signs = np.array([[1, 1], [-1, -1], [1, -1], [-1, 1], [0, 0]])
    return signs[rng.choice(5, (trials, most), p=[0.6, 0.13, 0.11, 0.11, 0.05])]


PLANS = {"forward": _forward, "mixed": _mixed}
"""Signs (trials, commands, 2) that the wheel speeds are multiplied by."""
