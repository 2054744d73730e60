"""Evolution on a GPU: one block is the population of one run, generation after generation in one launch."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import cuda, float32

from bns.engine.breeding import COMPONENTS, cut_places, mutated, mutation_threshold, spliced, winner
from bns.engine.evolution import CommandBounds
from bns.engine.philox import Purpose, philox
from bns.engine.snn import weight_count

_PARENTS, _CUTS, _MUTATION = np.uint32(Purpose.PARENTS), np.uint32(Purpose.CUTS), np.uint32(Purpose.MUTATION)
_FIRST = np.uint32(0)


@cuda.jit(device=True)
def _copy(source, start, target, at, count):  # type: ignore[no-untyped-def]  # compiled
    for j in range(count):
        for c in range(COMPONENTS):
            target[at + j, c] = source[start + j, c]


@cuda.jit(device=True)
def _cross(parents, lengths, front, back, cut_front, cut_back, shortest, longest, child):  # type: ignore[no-untyped-def]  # compiled
    """As in `bns.engine.breeding`; what is kept of the child, and whether it was cut at the bound."""
    first, cut_back, length, kept = spliced(cut_front, cut_back, lengths[back], shortest, longest)
    _copy(parents[front], 0, child, 0, first)
    _copy(parents[back], cut_back, child, first, kept - first)
    return kept, length > kept


def evolution_kernel(scored: Any, bounds: CommandBounds, networks: int, hidden: int) -> Any:
    """Kernel for robots whose device function scored(w, commands, length, goals) gives fitness and goals reached.

    Launch it on a grid (runs,). Arguments: the number of this evaluation (0: the first population is only scored, and no
    failure counted); settings (runs,); weights (runs, networks, W) float32; commands (2, runs, n, longest, 3) float32 and
    lengths (2, runs, n) int32, of which one half are the parents and the other is bred into; fitness (runs, n) float64,
    reached and order (runs, n) int32; cdf (runs, n) float64 of the tournament for parents; goals (runs, most, 2) float64;
    failures and hits (runs,) int32 are added to.
    """
    low, high, span = bounds.low, bounds.high, bounds.mutation_span
    width = weight_count(hidden)
    floats = networks * width

    @cuda.jit(device=True)
    def mutate(child, length, individual, threshold, step, key0, key1):  # type: ignore[no-untyped-def]  # compiled
        for j in range(length):
            draws = philox(np.uint32(j), np.uint32(individual), step, _MUTATION, key0, key1)
            for c in range(COMPONENTS):
                word = np.uint64(draws[c])
                if word < threshold:
                    child[j, c] = mutated(child[j, c], word, threshold, low[c], high[c], span[c])

    @cuda.jit(device=True)
    def bred(parents, lengths, order, cdf, children, child_lengths, pair, rate, shortest, longest, step, key0, key1):  # type: ignore[no-untyped-def]  # compiled
        """Both children of a pair; how many of them were cut at the bound."""
        n, first = order.size, 1 + 2 * pair
        draws = philox(_FIRST, np.uint32(pair), step, _PARENTS, key0, key1)
        a, b = winner(order, cdf, draws[0]), winner(order, cdf, draws[1])
        draws = philox(_FIRST, np.uint32(pair), step, _CUTS, key0, key1)
        cut_a, cut_b = cut_places(draws[0], draws[1], draws[2], lengths[a], lengths[b])
        threshold, hits = mutation_threshold(rate), 0
        kept, cut = _cross(parents, lengths, a, b, cut_a, cut_b, shortest, longest, children[first])
        child_lengths[first] = kept
        hits += cut
        mutate(children[first], kept, first, threshold, step, key0, key1)
        if first + 1 < n:
            kept, cut = _cross(parents, lengths, b, a, cut_b, cut_a, shortest, longest, children[first + 1])
            child_lengths[first + 1] = kept
            hits += cut
            mutate(children[first + 1], kept, first + 1, threshold, step, key0, key1)
        return hits

    @cuda.jit
    def evolve(  # type: ignore[no-untyped-def]  # compiled
        evaluation, settings, weights, commands, lengths, fitness, reached, order, cdf, goals, failures, hits
    ):
        w = cuda.shared.array(floats, float32)
        run, thread, threads = cuda.blockIdx.x, cuda.threadIdx.x, cuda.blockDim.x
        own = settings[run]
        if evaluation > own["evaluations"]:
            return
        n, key0, key1 = own["population"], own["key0"], own["key1"]
        before = own["generations"] * max(evaluation - 1, 0)
        values, ranking, shares, aims = fitness[run, :n], order[run, :n], cdf[run, :n], goals[run, : own["goals"]]
        for i in range(thread, floats, threads):
            w[i] = weights[run, i // width, i % width]
        cuda.syncthreads()
        for generation in range(own["generations"] + 1 if evaluation > 0 else 1):
            step, half = before + generation, (before + generation) % 2
            some, long = commands[half, run, :n], lengths[half, run, :n]
            if generation > 0:
                old, old_long = commands[1 - half, run, :n], lengths[1 - half, run, :n]
                if thread == 0:
                    long[0] = old_long[ranking[0]]
                    _copy(old[ranking[0]], 0, some[0], 0, long[0])
                for pair in range(thread, n // 2, threads):
                    cut = bred(
                        old, old_long, ranking, shares, some, long, pair, own["mutation_rate"], own["shortest"],
                        own["longest"], np.uint32(step), key0, key1,
                    )  # fmt: skip
                    if cut > 0:
                        cuda.atomic.add(hits, run, cut)
                cuda.syncthreads()
            for i in range(thread, n, threads):
                values[i], reached[run, i] = scored(w, some[i], long[i], aims)
                if values[i] == 0.0 and evaluation > 0:
                    cuda.atomic.add(failures, run, 1)
            cuda.syncthreads()
            for i in range(thread, n, threads):
                ranking[_place(values, i)] = i
            cuda.syncthreads()

    return evolve


@cuda.jit(device=True)
def _place(fitness, i):  # type: ignore[no-untyped-def]  # compiled
    """Rank of a controller: how many are better, or as good and come before it. What failed is worst, as in `bns.engine`."""
    place = 0
    own = fitness[i] if fitness[i] > 0 else 0.0
    for k in range(fitness.size):
        other = fitness[k] if fitness[k] > 0 else 0.0
        place += other > own or (other == own and k < i)
    return place
