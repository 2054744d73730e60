"""How lists of commands of varying length breed on a GPU: the loops around the rules of `bns.engine.breeding`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import cuda

from bns.engine.breeding import COMPONENTS, couple, cut_places, mutated, mutation_threshold, spliced
from bns.engine.evolution import CommandBounds
from bns.engine.philox import Purpose, philox

_CUTS, _MUTATION, _FIRST = np.uint32(Purpose.CUTS), np.uint32(Purpose.MUTATION), np.uint32(0)


@cuda.jit(device=True)
def _copy(source, start, target, at, count):  # type: ignore[no-untyped-def]  # compiled
    for j in range(count):
        for c in range(COMPONENTS):
            target[at + j, c] = source[start + j, c]


@cuda.jit(device=True)
def _cross(parents, lengths, front, back, cut_front, cut_back, own, child):  # type: ignore[no-untyped-def]  # compiled
    """As in `bns.engine.breeding`; what is kept of the child, and whether it was cut at the bound."""
    first, cut_back, length, kept = spliced(cut_front, cut_back, lengths[back], own["shortest"], own["longest"])
    _copy(parents[front], 0, child, 0, first)
    _copy(parents[back], cut_back, child, first, kept - first)
    return kept, length > kept


def breeding_of_lists(bounds: CommandBounds) -> Any:
    """Device function bred(parents, lengths, order, cdf, children, child_lengths, pair, own, step) for commands within these
    bounds: it makes both children of a pair and says how many of them were cut at the bound; own is the run's settings.
    """
    low, high, span = bounds.low, bounds.high, bounds.mutation_span

    @cuda.jit(device=True)
    def mutate(child, length, individual, own, step):  # type: ignore[no-untyped-def]  # compiled
        threshold = mutation_threshold(own["mutation_rate"])
        for j in range(length):
            draws = philox(np.uint32(j), np.uint32(individual), step, _MUTATION, own["key0"], own["key1"])
            for c in range(COMPONENTS):
                word = np.uint64(draws[c])
                if word < threshold:
                    child[j, c] = mutated(child[j, c], word, threshold, low[c], high[c], span[c])

    @cuda.jit(device=True)
    def bred(parents, lengths, order, cdf, children, child_lengths, pair, own, step):  # type: ignore[no-untyped-def]  # compiled
        a, b = couple(order, cdf, pair, step, own["key0"], own["key1"])
        draws = philox(_FIRST, np.uint32(pair), step, _CUTS, own["key0"], own["key1"])
        cut_a, cut_b = cut_places(draws[0], draws[1], draws[2], lengths[a], lengths[b])
        hits = 0
        for child in range(1 + 2 * pair, min(3 + 2 * pair, order.size)):
            kept, cut = _cross(parents, lengths, a, b, cut_a, cut_b, own, children[child])
            child_lengths[child] = kept
            hits += cut
            mutate(children[child], kept, child, own, step)
            a, b, cut_a, cut_b = b, a, cut_b, cut_a
        return hits

    return bred
