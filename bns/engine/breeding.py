"""How lists of commands of varying length breed: tournaments, two-parent crossover, mutation (section 4.3).

Of every command of a child it is kept where it comes from (`Population.origin`), so that what the networks said of it need not
be computed again. The networks see a command together with the speeds of the one before, so both must be unchanged.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from bns.engine.evolution import CommandBounds, Population
from bns.engine.jit import copy_items, exact, fast, inline
from bns.engine.philox import Key, Purpose, philox

IDENTICAL_CUT = 0.8
"""Probability that both parents are cut at the same place (section 4.3)."""
COMPONENTS = 3
"""Numbers a command has: left, right, duration."""
SPEEDS = 2
"""The first of them, which the networks are told of the command before, too."""
_UNIT = 2.0**-32
_PARENTS, _FIRST = np.uint32(Purpose.PARENTS), np.uint32(0)


class Operators(NamedTuple):
    """How crossover and mutation work, where section 4.3 can be read in more than one way; the defaults are those of bns."""

    exact: tuple[bool, ...] = (False,) * COMPONENTS
    """Components that mutate by their span exactly, down or up, instead of uniformly within it."""
    one_component: bool = False
    """A command mutates with the given probability, in one of its components; else every component by itself."""
    cuts_inside: bool = False
    """No list is cut before its first or behind its last command, so that a child has commands of both parents."""


DEFAULT = Operators()


@exact
def winner(order, cdf, word):  # type: ignore[no-untyped-def]  # compiled
    """As `evolution.pick`: the first rank whose share lies above the draw. Halved without a branch to guess."""
    u, at, left = word * _UNIT, 0, cdf.size
    while left > 1:
        half = left >> 1
        at += half * np.int64(cdf[at + half - 1] <= u)
        left -= half
    return order[min(at + np.int64(cdf[at] <= u), order.size - 1)]


@inline
def couple(order, cdf, pair, step, k0, k1):  # type: ignore[no-untyped-def]  # compiled
    """Two tournament winners: the parents of a pair of children."""
    draws = philox(_FIRST, np.uint32(pair), step, _PARENTS, k0, k1)
    return winner(order, cdf, draws[0]), winner(order, cdf, draws[1])


@inline
def below(word: Any, n: Any) -> Any:
    """Uniform whole number 0..n-1."""
    return np.int64(np.uint64(word) * np.uint64(n) >> np.uint64(32))


@inline
def cut_places(how: Any, one: Any, other: Any, length_a: Any, length_b: Any) -> Any:
    """Where two parents of these lengths are cut, by three words: at the same place or each at its own."""
    if how * _UNIT >= IDENTICAL_CUT:
        return below(one, length_a + 1), below(other, length_b + 1)
    same = below(one, min(length_a, length_b) + 1)
    return same, same


@inline
def inner_cut_places(how: Any, one: Any, other: Any, length_a: Any, length_b: Any) -> Any:
    """As `cut_places`, never at an end; a list of a single command is cut behind it."""
    if how * _UNIT >= IDENTICAL_CUT:
        return 1 + below(one, max(length_a - 1, 1)), 1 + below(other, max(length_b - 1, 1))
    same = 1 + below(one, max(min(length_a, length_b) - 1, 1))
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


@inline
def _same_before(lists, front, back):  # type: ignore[no-untyped-def]  # compiled
    """Whether the two commands that end at these places have the same speeds."""
    a, b = front - COMPONENTS, back - COMPONENTS
    return lists[a] == lists[b] and lists[a + 1] == lists[b + 1]


@inline
def _cross(children, origin, child, lists, lengths, starts, numbers, front, back, cut_front, cut_back, shortest):  # type: ignore[no-untyped-def]  # compiled
    """First cut_front commands of one parent, then the other parent's from cut_back on; the length before and after the bound.

    children, origin and lists are laid end to end. starts (n,): the number of each parent's first command, counted through
    all lists; numbers: all of them, to be copied from.
    """
    capacity = origin.size // lengths.size
    first, cut_back, length, kept = spliced(cut_front, cut_back, lengths[back], shortest, capacity)
    to, begin, rest = child * capacity, front * capacity, back * capacity + cut_back
    copy_items(children, to * COMPONENTS, lists, begin * COMPONENTS, first * COMPONENTS)
    copy_items(children, (to + first) * COMPONENTS, lists, rest * COMPONENTS, (kept - first) * COMPONENTS)
    copy_items(origin, to, numbers, starts[front], first)
    copy_items(origin, to + first, numbers, starts[back] + cut_back, kept - first)
    if first < kept and first + cut_back > 0:
        at_rest = first == 0 or cut_back == 0  # in one list, but not in the other
        if at_rest or not _same_before(lists, (begin + first) * COMPONENTS, rest * COMPONENTS):
            origin[to + first] = -1
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


@exact
def _hits(words, threshold, places):  # type: ignore[no-untyped-def]  # compiled
    """Places of the words below the threshold, and how many: without a branch, which would be guessed wrongly."""
    count = 0
    for m in range(words.size):
        places[count] = m
        count += int(words[m] < threshold)
    return count


@inline
def mutation_threshold(rate: Any) -> Any:
    """Words below it mutate."""
    return np.uint64(rate / _UNIT)


@inline
def mutated(value: Any, word: Any, threshold: Any, low: Any, high: Any, span: Any) -> Any:
    """A component moved by a word that fell below the threshold: it is uniform there, so it serves twice."""
    moved = value + np.float32((2.0 * np.float64(word) / np.float64(threshold) - 1.0) * span)
    return min(max(moved, low), high)


@inline
def stepped(value: Any, word: Any, threshold: Any, low: Any, high: Any, span: Any) -> Any:
    """A component moved by its whole span, down or up by a word that fell below the threshold."""
    moved = value - span if np.float64(word) < 0.5 * np.float64(threshold) else value + span
    return min(max(moved, low), high)


@inline
def _chosen(draws: Any, where: Any, component: Any, one_component: Any) -> Any:
    """Whether a command that mutates does so in this component: always, or where the second word says so."""
    return not one_component or below(draws[1, where], COMPONENTS) == component


@exact
def _mutate(children, origin, lengths, rate, low, high, span, stepwise, one_component, step, k0, k1):  # type: ignore[no-untyped-def]  # compiled
    """Mutate all controllers but the first, which is the elite."""
    total = lengths.sum() - lengths[0]
    slot, individual = np.empty(total, np.uint32), np.empty(total, np.uint32)
    m = 0
    for i in range(1, lengths.size):
        for j in range(lengths[i]):
            slot[m], individual[m] = j, i
            m += 1
    draws, places = np.empty((COMPONENTS, total), np.uint32), np.empty(total, np.int64)
    _draws(slot, individual, Purpose.MUTATION, step, k0, k1, draws)
    threshold, capacity = mutation_threshold(rate), origin.shape[1]
    every, every_origin = children.reshape(-1), origin.reshape(-1)
    for c in range(COMPONENTS):
        row, least, most, most_moved = draws[0 if one_component else c], low[c], high[c], span[c]
        for h in range(_hits(row, threshold, places)):
            drawn = np.uint64(places[h])  # without a sign no place is counted from the end
            if not _chosen(draws, drawn, c, one_component):
                continue
            whose, which = np.int64(individual[drawn]), np.int64(slot[drawn])
            command = whose * capacity + which
            at = np.uint64(command * COMPONENTS + c)
            if stepwise[c]:
                every[at] = stepped(every[at], row[drawn], threshold, least, most, most_moved)
            else:
                every[at] = mutated(every[at], row[drawn], threshold, least, most, most_moved)
            every_origin[np.uint64(command)] = -1
            if c < SPEEDS and which + 1 < lengths[whose]:
                every_origin[np.uint64(command + 1)] = -1


@exact
def _starts(lengths):  # type: ignore[no-untyped-def]  # compiled
    """The number of each list's first command, counted through all lists."""
    return (np.cumsum(lengths) - lengths).astype(np.int64)


@exact
def breed_into(  # type: ignore[no-untyped-def]  # compiled
    commands, lengths, order, cdf, rate, low, high, span, stepwise, one_component, cuts_inside, shortest, step, k0, k1,
    children, child_lengths, origin,
):
    """Fill children with the best controller and the offspring of tournament winners; count those cut at the bound."""
    hits, n, best = 0, commands.shape[0], order[0]
    starts, numbers = _starts(lengths), np.arange(lengths.sum()).astype(np.int32)
    every, every_child, every_origin = commands.reshape(-1), children.reshape(-1), origin.reshape(-1)
    _, child_lengths[0] = _cross(every_child, every_origin, 0, every, lengths, starts, numbers, best, best, 0, 0, 0)
    slot, pairs = np.zeros(n // 2, np.uint32), np.arange(n // 2).astype(np.uint32)
    parents, cuts = np.empty((3, n // 2), np.uint32), np.empty((3, n // 2), np.uint32)
    _draws(slot, pairs, Purpose.PARENTS, step, k0, k1, parents)
    _draws(slot, pairs, Purpose.CUTS, step, k0, k1, cuts)
    for pair in range(n // 2):
        first = 1 + 2 * pair
        a, b = winner(order, cdf, parents[0, pair]), winner(order, cdf, parents[1, pair])
        how, one, other = cuts[0, pair], cuts[1, pair], cuts[2, pair]
        if cuts_inside:
            cut_a, cut_b = inner_cut_places(how, one, other, lengths[a], lengths[b])
        else:
            cut_a, cut_b = cut_places(how, one, other, lengths[a], lengths[b])
        for child in range(first, min(first + 2, n)):
            length, kept = _cross(
                every_child, every_origin, child, every, lengths, starts, numbers, a, b, cut_a, cut_b, shortest
            )
            child_lengths[child] = kept
            hits += length > kept
            a, b, cut_a, cut_b = b, a, cut_b, cut_a
    _mutate(children, origin, child_lengths, rate, low, high, span, stepwise, one_component, step, k0, k1)
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
    operators: Operators = DEFAULT,
) -> int:
    """One generation into `children` (same shapes as parents); how many children were cut at the longest list allowed.

    Elitism: the best controller goes on unchanged. Two-parent crossover swaps the first segments; the cut is the same in
    80 % and independent in 20 % of the pairs. Every component mutates with probability `rate`, uniformly within its
    span, and stays within its bounds (section 4.3). ``operators`` are other readings of these sentences.
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
            np.array(operators.exact),
            operators.one_component,
            operators.cuts_inside,
            shortest,
            np.uint32(generation),
            *key.words,
            children.commands,
            children.lengths,
            children.origin,
        )
    )
