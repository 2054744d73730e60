"""The genetic algorithm over command lists of varying length: ranking, tournaments, crossover, mutation, diversity.

A population is `commands` (n, longest, 3) float32 in device units and `lengths` (n,) int32. Fitness is larger for better,
and 0 where the arithmetic failed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bns.engine.jit import exact, fast, inline
from bns.engine.philox import Key, Purpose, philox, uniforms, words

IDENTICAL_CUT = 0.8
"""Probability that both parents are cut at the same place (section 4.3)."""
COMPONENTS = 3
"""Numbers a command has: left, right, duration."""
_UNIT = 2.0**-32


@dataclass
class Population:
    """Controllers side by side: commands (n, longest, components) float32, lengths (n,) int32."""

    commands: np.ndarray
    lengths: np.ndarray

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
    return np.argsort(np.where(fitness > 0, -fitness, 0.0), kind="stable")


def pick(key: Key, purpose: Purpose, step: int, order: np.ndarray, cdf: np.ndarray) -> int:
    """The winner of one tournament."""
    u = words(key, purpose, step, 1, 1)[0, 0, 0] * _UNIT
    return int(order[np.searchsorted(cdf, u, side="right")])


@exact
def winner(order, cdf, word):  # type: ignore[no-untyped-def]  # compiled
    """As `pick`: the first rank whose share lies above the draw. Halving without a branch, which would be guessed wrongly."""
    u, at, left = word * _UNIT, 0, cdf.size
    while left > 1:
        half = left >> 1
        at += half * np.int64(cdf[at + half - 1] <= u)
        left -= half
    return order[min(at + np.int64(cdf[at] <= u), order.size - 1)]


@inline
def below(word: Any, n: Any) -> Any:
    """Uniform whole number 0..n-1."""
    return np.int64(np.uint64(word) * np.uint64(n) >> np.uint64(32))


@inline
def _copy(source, row, start, target, child, at, count):  # type: ignore[no-untyped-def]  # compiled
    for e in range(count):
        target[child, at + e] = source[row, start + e]


@inline
def cut_places(how: Any, one: Any, other: Any, length_a: Any, length_b: Any) -> Any:
    """Where two parents of these lengths are cut, by three words: at the same place or each at its own."""
    if how * _UNIT >= IDENTICAL_CUT:
        return below(one, length_a + 1), below(other, length_b + 1)
    same = below(one, min(length_a, length_b) + 1)
    return same, same


@inline
def spliced(cut_front: Any, cut_back: Any, length_back: Any, shortest: Any, capacity: Any) -> Any:
    """A child of two cuts: how many commands of the front parent, the back parent's first, the length, and what is kept of it.

    Too short a list is not made: the parent passes unchanged.
    """
    length = cut_front + length_back - cut_back
    if length < shortest:
        cut_front, cut_back, length = 0, 0, length_back
    kept = min(length, capacity)
    return min(cut_front, kept), cut_back, length, kept


@exact
def _cross(children, child, lists, lengths, front, back, cut_front, cut_back, shortest):  # type: ignore[no-untyped-def]  # compiled
    """First cut_front commands of one parent, then the other parent's from cut_back on; the length before and after the bound.

    children and lists are (n, capacity * components): lists of commands laid end to end.
    """
    capacity = lists.shape[1] // COMPONENTS
    first, cut_back, length, kept = spliced(cut_front, cut_back, lengths[back], shortest, capacity)
    _copy(lists, front, 0, children, child, 0, first * COMPONENTS)
    _copy(lists, back, cut_back * COMPONENTS, children, child, first * COMPONENTS, (kept - first) * COMPONENTS)
    return length, kept


@fast
def _draws(slot, individual, purpose, step, k0, k1, out):  # type: ignore[no-untyped-def]  # compiled
    """Three words for each (slot, individual) into out (3, n), all at once, so that the generator vectorises."""
    first, second, third = out[0], out[1], out[2]
    for m in range(slot.size):
        draws = philox(slot[m], individual[m], step, np.uint32(purpose), k0, k1)
        first[m] = draws[0]
        second[m] = draws[1]
        third[m] = draws[2]


@inline
def mutation_threshold(rate: Any) -> Any:
    """Words below it mutate."""
    return np.uint64(rate / _UNIT)


@inline
def mutated(value: Any, word: Any, threshold: Any, low: Any, high: Any, span: Any) -> Any:
    """A component moved by a word that fell below the threshold: it is uniform there, so it serves twice."""
    moved = value + np.float32((2.0 * np.float64(word) / np.float64(threshold) - 1.0) * span)
    return min(max(moved, low), high)


@exact
def _mutate(children, lengths, rate, low, high, span, step, k0, k1):  # type: ignore[no-untyped-def]  # compiled
    """Mutate all controllers but the first, which is the elite."""
    total = 0
    for i in range(1, lengths.size):
        total += lengths[i]
    slot, individual = np.empty(total, np.uint32), np.empty(total, np.uint32)
    m = 0
    for i in range(1, lengths.size):
        for j in range(lengths[i]):
            slot[m], individual[m] = j, i
            m += 1
    draws = np.empty((3, total), np.uint32)
    _draws(slot, individual, Purpose.MUTATION, step, k0, k1, draws)
    threshold = mutation_threshold(rate)
    for c in range(COMPONENTS):
        for m in range(total):
            word = np.uint64(draws[c, m])
            if word < threshold:
                i, j = individual[m], slot[m]
                children[i, j, c] = mutated(children[i, j, c], word, threshold, low[c], high[c], span[c])


@exact
def breed_into(commands, lengths, order, cdf, rate, low, high, span, shortest, step, k0, k1, children, child_lengths):  # type: ignore[no-untyped-def]  # compiled
    """Fill children with the best controller and the offspring of tournament winners; count those cut at the bound."""
    hits = 0
    n = commands.shape[0]
    lists, child_lists = commands.reshape(n, -1), children.reshape(n, -1)
    best = order[0]
    _copy(lists, best, 0, child_lists, 0, 0, lengths[best] * COMPONENTS)
    child_lengths[0] = lengths[best]
    slot, pairs = np.zeros(n // 2, np.uint32), np.arange(n // 2).astype(np.uint32)
    parents, cuts = np.empty((3, n // 2), np.uint32), np.empty((3, n // 2), np.uint32)
    _draws(slot, pairs, Purpose.PARENTS, step, k0, k1, parents)
    _draws(slot, pairs, Purpose.CUTS, step, k0, k1, cuts)
    for pair in range(n // 2):
        first = 1 + 2 * pair
        a, b = winner(order, cdf, parents[0, pair]), winner(order, cdf, parents[1, pair])
        cut_a, cut_b = cut_places(cuts[0, pair], cuts[1, pair], cuts[2, pair], lengths[a], lengths[b])
        length, kept = _cross(child_lists, first, lists, lengths, a, b, cut_a, cut_b, shortest)
        child_lengths[first] = kept
        hits += length > kept
        if first + 1 < n:
            length, kept = _cross(child_lists, first + 1, lists, lengths, b, a, cut_b, cut_a, shortest)
            child_lengths[first + 1] = kept
            hits += length > kept
    _mutate(children, child_lengths, rate, low, high, span, step, k0, k1)
    return hits


def breed(
    key: Key,
    parents: Population,
    order: np.ndarray,
    cdf: np.ndarray,
    rate: float,
    bounds: CommandBounds,
    shortest: int,
    generation: int,
    children: Population,
) -> int:
    """One generation into `children` (same shapes as parents); how many children were cut at the longest list allowed.

    Elitism: the best controller goes on unchanged. Two-parent crossover swaps the first segments; the cut is the same in
    80 % and independent in 20 % of the pairs. Every component mutates with probability `rate`, uniformly within its
    span, and stays within its bounds (section 4.3).
    """
    return int(
        breed_into(
            parents.commands,
            parents.lengths,
            order,
            cdf,
            rate,
            bounds.low,
            bounds.high,
            bounds.mutation_span,
            shortest,
            np.uint32(generation),
            *key.words,
            children.commands,
            children.lengths,
        )
    )


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
