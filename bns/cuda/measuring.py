"""What is kept of each run after an evaluation, besides what was driven: one block a run."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import cuda, float64

from bns.cuda.networks import output
from bns.engine.breeding import COMPONENTS
from bns.engine.evolution import CommandBounds, spread
from bns.engine.snn import weight_count

MEASURED = (
    "diversity",
    "mean_fitness",
    "best_fitness",
    "training_error",
    "validation_error",
    "training_patterns",
    "validation_patterns",
    "mean_commands",
    "generations",
    "bound_hits",
    "arithmetic_failures",
)
"""In this order."""
THREADS = 128
"""Threads of a block at most."""
_SUMS = (5, THREADS)


@cuda.jit(device=True)
def _squared_errors(w, width, networks, X, targets, first, stride, n):  # type: ignore[no-untyped-def]  # compiled
    total = 0.0
    for p in range(first, n, stride):
        for net in range(networks):
            error = output(w, net * width, width, X[0, p], X[1, p], X[2, p], X[3, p], X[4, p])
            error = np.float64(error) - np.float64(targets[net, p])
            total += error * error
    return total


def measuring_kernel(bounds: CommandBounds, networks: int, hidden: int) -> Any:
    """Kernel for populations within these bounds; launch it on a grid (runs,) of at most `THREADS` threads.

    Arguments as those of `bns.cuda.evolution`, with weights (runs, networks W) and the patterns to train on and to watch: X (2,
    runs, 5, capacity), targets (2, runs, networks, capacity) float32, counts (2, runs) int32; rows (runs, evaluations, 11)
    takes `MEASURED`.
    """
    low, high = bounds.low, bounds.high
    width = weight_count(hidden)

    @cuda.jit
    def measure(  # type: ignore[no-untyped-def]  # compiled
        evaluation, settings, weights, commands, lengths, fitness, order, X, targets, counts, failures, hits, rows
    ):
        sums = cuda.shared.array(_SUMS, float64)
        run, thread, threads = cuda.blockIdx.x, cuda.threadIdx.x, cuda.blockDim.x
        own = settings[run]
        if evaluation > own["evaluations"]:
            return
        n, done = own["population"], own["generations"] * evaluation
        some, long, w = commands[done % 2, run], lengths[done % 2, run, :n], weights[run]
        for k in range(5):
            sums[k, thread] = 0.0
        for column in range(thread, own["longest"] * COMPONENTS, threads):
            j, c = column // COMPONENTS, column % COMPONENTS
            sums[0, thread] = spread(some, long, j, c, 1.0 / (high[c] - low[c]), sums[0, thread])
        for i in range(thread, n, threads):
            sums[1, thread] += fitness[run, i]
            sums[2, thread] += long[i]
        for which in range(2):
            sums[3 + which, thread] = _squared_errors(
                w, width, networks, X[which, run], targets[which, run], thread, threads, counts[which, run]
            )
        cuda.syncthreads()
        if thread > 0:
            return
        for other in range(1, threads):
            for k in range(5):
                sums[k, 0] += sums[k, other]
        row = rows[run, evaluation - 1]
        row[0], row[1], row[2] = sums[0, 0] / n, sums[1, 0] / n, fitness[run, order[run, 0]]
        for which in range(2):
            patterns = counts[which, run]
            row[3 + which] = sums[3 + which, 0] / (networks * patterns) if patterns > 0 else np.nan
            row[5 + which] = patterns
        row[7], row[8], row[9], row[10] = sums[2, 0] / n, done, hits[run], failures[run]

    return measure
