"""Populations of command lists of varying length: ranking, tournaments, diversity. How they breed: `bns.engine.breeding`.

A population is `commands` (n, longest, 3) float32 in device units and `lengths` (n,) int32. Fitness is larger for better,
and 0 where the arithmetic failed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bns.engine.jit import exact, inline
from bns.engine.philox import Key, Purpose, uniforms, words

_UNIT = 2.0**-32


@dataclass
class Population:
    """Controllers side by side: commands (n, longest, components) float32, lengths (n,) int32.

    ``origin`` (n, longest) int32 says of each command where its parents' generation had the same command after the same
    one, counted through all lists; -1 where it is new. Whoever knows what the old ones do need only ask for the new.
    """

    commands: np.ndarray
    lengths: np.ndarray
    origin: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.origin = np.full(self.commands.shape[:2], -1, np.int32)

    def controller(self, index: int) -> np.ndarray:
        """The commands of one controller, (length, components), a copy."""
        return self.commands[index, : self.lengths[index]].copy()

    def __len__(self) -> int:
        return len(self.lengths)


@dataclass(frozen=True)
class CommandBounds:
    """What a command's components may be and how far a mutation moves them, each (components,) float32."""

    low: np.ndarray
    high: np.ndarray
    mutation_span: np.ndarray


def random_population(
    key: Key, n: int, shortest: int, longest: int, capacity: int, bounds: CommandBounds
) -> Population:
    """Uniform lengths shortest..longest and uniform commands; lists are cut at capacity."""
    draws = words(key, Purpose.INITIAL_LENGTH, 0, n, 1)[:, 0, 0].astype(np.uint64)
    lengths = shortest + (draws * np.uint64(longest - shortest + 1) >> np.uint64(32)).astype(np.int32)
    width = len(bounds.low)
    u = uniforms(key, Purpose.INITIAL_COMMAND, 0, n, min(longest, capacity))[..., :width]
    commands = np.zeros((n, capacity, width), np.float32)
    commands[:, : u.shape[1]] = bounds.low + u * (bounds.high - bounds.low)
    return Population(commands, np.minimum(lengths, capacity).astype(np.int32))


def tournament_cdf(n: int, share: float) -> np.ndarray:
    """P(rank of the winner <= r), r = 0..n-1, for a tournament among distinct members of a ranked population.

    One draw through this table is one tournament, whatever its size. The size is share * n, rounded, at least 1.
    """
    k = min(n, max(1, int(share * n + 0.5)))
    # P(all k members rank behind r) = C(n-1-r, k) / C(n, k), from r to r + 1 by one factor.
    behind = n - 1.0 - np.arange(n)
    factors = np.maximum(behind - k + 1, 0.0) / (behind + 1)
    return 1.0 - np.cumprod(factors)


def rank(fitness: np.ndarray) -> np.ndarray:
    """Indices from best to worst; equals keep their order; NaN and 0 come last. int64 (n,)."""
    worth = np.fmax(fitness, 0.0)
    order = np.argsort(-worth)  # with the sort of equals below it takes half as long as a stable sort
    _equals_in_order(order, worth)
    return order


@exact
def _equals_in_order(order, worth):  # type: ignore[no-untyped-def]  # compiled
    begin = 0
    for end in range(1, order.size + 1):
        if end == order.size or worth[order[end]] != worth[order[begin]]:
            if end - begin > 1:
                order[begin:end].sort()
            begin = end


def pick(key: Key, purpose: Purpose, step: int, order: np.ndarray, cdf: np.ndarray) -> int:
    """The winner of one tournament."""
    u = words(key, purpose, step, 1, 1)[0, 0, 0] * _UNIT
    return int(order[np.searchsorted(cdf, u, side="right")])


@inline
def spread(commands: Any, lengths: Any, j: Any, c: Any, scale: Any, total: Any) -> Any:
    """Add to total how far component c of everybody's command j is from the mean one."""
    members, mean = 0, 0.0
    for i in range(lengths.size):
        if lengths[i] > j:
            members += 1
            mean += commands[i, j, c]
    if members > 0:
        mean /= members
        for i in range(lengths.size):
            if lengths[i] > j:
                total += abs(commands[i, j, c] - mean) * scale
    return total


@exact
def _diversity(commands, lengths, low, high):  # type: ignore[no-untyped-def]  # compiled
    total = 0.0
    for c in range(commands.shape[2]):
        scale = 1.0 / (high[c] - low[c])
        for j in range(lengths.max()):
            total = spread(commands, lengths, j, c, scale, total)
    return total / lengths.size


def diversity(population: Population, bounds: CommandBounds) -> float:
    """Equation 4.1, commands normalised to their range: mean over controllers of the summed distances from the mean command."""
    return float(_diversity(population.commands, population.lengths, bounds.low, bounds.high))
