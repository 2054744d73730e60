"""Command sequences that a robot can drive inside an arena: drawn at random, and varied."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.settings import DEFAULTS

MARGIN_M = DEFAULTS.design.margin_m
BRIEFEST = DEFAULTS.design.briefest
_TRIES = DEFAULTS.design.tries
_ALONG = DEFAULTS.design.along


@dataclass(frozen=True)
class Arena:
    """Where the robot may be (m), and the pose (x_m, y_m, heading_rad) from which every trial starts."""

    x_low_m: float
    x_high_m: float
    y_low_m: float
    y_high_m: float
    start: tuple[float, float, float]

    def holds(self, x_m: Array, y_m: Array, margin_m: float | None = None) -> NDArray[np.bool_]:
        """Which places are inside by that margin."""
        margin_m = MARGIN_M if margin_m is None else margin_m
        inside_x = (x_m >= self.x_low_m + margin_m) & (x_m <= self.x_high_m - margin_m)
        inside: NDArray[np.bool_] = inside_x & (y_m >= self.y_low_m + margin_m) & (y_m <= self.y_high_m - margin_m)
        return inside


@dataclass(frozen=True)
class Bounds:
    """What may be commanded: wheel speeds (m/s), durations of a command (s), how long a trial lasts (s); times are multiples
    of ``grid_s``. ``robot``: that of this project which takes all of these, if any: `bns trial` can drive the experiment."""

    slowest_m_s: float
    fastest_m_s: float
    shortest_s: float
    longest_s: float
    trial_s: float
    grid_s: float = 0.04
    robot: str = ""


class Plan(Protocol):
    """Trials that may be driven next."""

    def __len__(self) -> int:
        """How many there are."""

    @property
    def lasting_s(self) -> Array:
        """How long each takes, (trials,)."""

    def only(self, chosen: NDArray[np.int64]) -> Self:
        """Some of them, in the order of ``chosen``."""

    def joined(self, others: Self) -> Self:
        """These, then the others."""


@dataclass(frozen=True)
class Sequences:
    """Commands of some trials, (trials, commands) each, padded with commands of 0 s."""

    left_m_s: Array
    right_m_s: Array
    duration_s: Array

    def __len__(self) -> int:
        return len(self.duration_s)

    @property
    def lasting_s(self) -> Array:
        """How long each trial takes, (trials,)."""
        return self.duration_s.sum(axis=1)

    def only(self, chosen: NDArray[np.int64]) -> Sequences:
        """Some of the trials, in the order of ``chosen``."""
        return Sequences(self.left_m_s[chosen], self.right_m_s[chosen], self.duration_s[chosen])

    def joined(self, others: Sequences) -> Sequences:
        """These trials, then the others."""
        width = max(self.duration_s.shape[1], others.duration_s.shape[1])
        parts = [
            [np.pad(v, ((0, 0), (0, width - v.shape[1]))) for v in (s.left_m_s, s.right_m_s, s.duration_s)]
            for s in (self, others)
        ]
        return Sequences(*(np.concatenate(pair) for pair in zip(*parts, strict=True)))


Draw = Callable[[np.random.Generator, int], Array]
"""(trials, 3) of left m/s, right m/s, duration s for the next command of every trial."""


def uniform(bounds: Bounds) -> Draw:
    """Speeds of both wheels and durations evenly spread over what is allowed: the plain random experiment."""

    def draw(rng: np.random.Generator, count: int) -> Array:
        speeds = rng.uniform(bounds.slowest_m_s, bounds.fastest_m_s, (count, 2))
        return np.column_stack([speeds, rng.uniform(bounds.shortest_s, bounds.longest_s, count)])

    return draw


def extreme(bounds: Bounds) -> Draw:
    """The corners and edges more often than the middle: full and least speed, straight, standing, spinning, short and long."""

    def draw(rng: np.random.Generator, count: int) -> Array:
        low, high = bounds.slowest_m_s, bounds.fastest_m_s
        levels = np.array([low, high, high, (low + high) / 2, min(max(0.0, low), high)])
        speeds = np.where(
            rng.random((count, 2)) < 0.6, rng.choice(levels, (count, 2)), rng.uniform(low, high, (count, 2))
        )
        straight = rng.random(count) < 0.3
        speeds[straight, 1] = speeds[straight, 0]
        lasts = np.exp(rng.uniform(np.log(bounds.shortest_s), np.log(bounds.longest_s), count))
        return np.column_stack([speeds, lasts])

    return draw


def draw_sequences(
    rng: np.random.Generator,
    count: int,
    bounds: Bounds,
    arena: Arena,
    base_m: float,
    draw: Draw,
    lasting_s: Array | None = None,
) -> Sequences:
    """``count`` trials of about ``lasting_s`` (count,), else ``trial_s`` each, command by command; what would leave the arena is
    drawn again, and in the end left out.

    Paths are those of the ideal drive with a wheelbase of ``base_m``: who needs them exactly looks again.
    """
    pose = np.tile(np.array(arena.start), (count, 1))
    left_s = np.full(count, bounds.trial_s) if lasting_s is None else lasting_s
    commands: list[Array] = []
    while (left_s >= bounds.shortest_s - 1e-9).any() and len(commands) < _most(bounds):
        now = np.zeros((count, 3))
        waiting = left_s >= bounds.shortest_s - 1e-9
        for _ in range(_TRIES):
            tried = _trimmed(draw(rng, count), left_s, bounds)
            ahead = _arc(pose, tried, base_m)
            good = waiting & arena.holds(ahead[..., 0], ahead[..., 1]).all(axis=1)
            now[good] = tried[good]
            pose[good] = ahead[good, -1]
            waiting &= ~good
        left_s = np.where(waiting, 0.0, left_s - now[:, 2])
        commands.append(now)
    stacked = np.stack(commands, axis=1)
    return Sequences(stacked[..., 0], stacked[..., 1], stacked[..., 2])


def mutate_sequences(rng: np.random.Generator, parents: Sequences, bounds: Bounds, draw: Draw) -> Sequences:
    """One child of every trial: commands exchanged, stretched, made faster or slower, two swapped, the last one left out."""
    stacked = np.stack([parents.left_m_s, parents.right_m_s, parents.duration_s], axis=2)
    count, most = stacked.shape[:2]
    used = stacked[..., 2] > 0
    fresh = draw(rng, count * most).reshape(count, most, 3)
    child = np.where((rng.random((count, most, 1)) < 1.5 / most) & used[..., None], fresh, stacked)
    push = rng.normal(0, 0.2, (count, most, 2)) * (bounds.fastest_m_s - bounds.slowest_m_s)
    child[..., :2] += push * (rng.random((count, most, 1)) < 0.2)
    child[..., 2] *= np.where(rng.random((count, most)) < 0.2, np.exp(rng.normal(0, 0.3, (count, most))), 1.0)
    for row in range(count):
        lasting = np.flatnonzero(used[row])
        if len(lasting) > 1 and rng.random() < 0.3:
            a, b = rng.choice(lasting, 2, replace=False)
            child[row, [a, b]] = child[row, [b, a]]
    ends = np.cumsum(child[..., 2], axis=1)
    spare = (np.arange(most) == used.sum(axis=1)[:, None] - 1) & (ends - child[..., 2] >= BRIEFEST * bounds.trial_s)
    used = used & ~(spare & (rng.random((count, 1)) < 0.3))
    out = np.zeros_like(child)
    left_s = np.full(count, bounds.trial_s)
    for k in range(most):
        now = _trimmed(child[:, k], left_s, bounds)
        now[~used[:, k] | (left_s < bounds.shortest_s - 1e-9)] = 0.0
        left_s = left_s - now[:, 2]
        out[:, k] = now
    return Sequences(out[..., 0], out[..., 1], out[..., 2])


def short_durations(rng: np.random.Generator, bounds: Bounds, count: int) -> Array:
    """Lengths (s) from the briefest to ``trial_s``, as many short as long, (count,)."""
    return bounds.trial_s * np.asarray(np.exp(rng.uniform(np.log(BRIEFEST), 0.0, count)))


def _trimmed(commands: Array, left_s: Array, bounds: Bounds) -> Array:
    """Within bounds, on the grid of times, and no longer than what is left of the trial."""
    lasts = np.clip(
        commands[:, 2], bounds.shortest_s, np.minimum(bounds.longest_s, np.maximum(left_s, bounds.shortest_s))
    )
    lasts = np.maximum(np.round(lasts / bounds.grid_s), 1) * bounds.grid_s
    speeds = np.clip(commands[:, :2], bounds.slowest_m_s, bounds.fastest_m_s)
    return np.column_stack([speeds, lasts])


def _arc(pose: Array, commands: Array, base_m: float) -> Array:
    """Poses along the next arc of every trial, (trials, _ALONG, 3)."""
    share = np.arange(1, _ALONG + 1) / _ALONG
    way = ((commands[:, 0] + commands[:, 1]) / 2 * commands[:, 2])[:, None] * share
    turn = ((commands[:, 1] - commands[:, 0]) / base_m * commands[:, 2])[:, None] * share
    chord, middle = way * np.sinc(turn / (2 * np.pi)), pose[:, 2:] + turn / 2
    return np.stack(
        [pose[:, :1] + chord * np.cos(middle), pose[:, 1:2] + chord * np.sin(middle), pose[:, 2:] + turn], axis=2
    )


def _most(bounds: Bounds) -> int:
    return max(int(bounds.trial_s / bounds.shortest_s), 1)
