"""Evolution on a GPU: one block is the population of one run, generation after generation in one launch."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import cuda, float32, float64

from bns.engine.snn import weight_count


def evolution_kernel(robot: Any, networks: int, hidden: int) -> Any:
    """Kernel for a robot of `bns.cuda.robots` with so many networks.

    Launch it on a grid (runs,). Arguments: the number of this evaluation (0: the first population is only scored, and no
    failure counted); settings (runs,); weights (runs, networks, W) float32; commands (2, runs, n, longest, components) float32
    and lengths (2, runs, n) int32, of which one half are the parents and the other is bred into; fitness (runs, n) float64,
    reached, used and order (runs, n) int32; cdf (runs, n) float64 of the tournament for parents; goals (runs, most, 2) float64;
    failures and hits (runs,) int32 are added to.
    """
    scored, bred, draw, draws = robot.scored, robot.bred, robot.draw, robot.DRAWS
    width = weight_count(hidden)
    floats = networks * width

    @cuda.jit
    def evolve(  # type: ignore[no-untyped-def]  # compiled
        evaluation, settings, weights, commands, lengths, fitness, reached, used, order, cdf, goals, failures, hits
    ):
        w = cuda.shared.array(floats, float32)
        luck = cuda.shared.array(draws, float64)
        run, thread, threads = cuda.blockIdx.x, cuda.threadIdx.x, cuda.blockDim.x
        own = settings[run]
        if evaluation > own["evaluations"]:
            return
        n, before = own["population"], own["generations"] * max(evaluation - 1, 0)
        values, ranking, shares, aims = fitness[run, :n], order[run, :n], cdf[run, :n], goals[run, : own["goals"]]
        for i in range(thread, floats, threads):
            w[i] = weights[run, i // width, i % width]
        for generation in range(own["generations"] + 1 if evaluation > 0 else 1):
            step, half = np.uint32(before + generation), (before + generation) % 2
            some, long = commands[half, run, :n], lengths[half, run, :n]
            draw(luck, own, step, thread, threads)
            if generation > 0:
                old, old_long = commands[1 - half, run, :n], lengths[1 - half, run, :n]
                if thread == 0:
                    best = ranking[0]
                    long[0] = old_long[best]
                    for j in range(long[0]):
                        for c in range(some.shape[2]):
                            some[0, j, c] = old[best, j, c]
                for pair in range(thread, n // 2, threads):
                    cut = bred(old, old_long, ranking, shares, some, long, pair, own, step)
                    if cut > 0:
                        cuda.atomic.add(hits, run, cut)
            cuda.syncthreads()
            for i in range(thread, n, threads):
                values[i], reached[run, i], used[run, i] = scored(w, some[i], long[i], aims, own, luck)
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
