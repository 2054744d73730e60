"""What is kept of each run after an evaluation, besides what was driven: one block a run."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import cuda, float64

from bns.cuda.on_device.networks import output, squashed_output
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
_SUMS = (7, THREADS)
"""Of diversity, fitness, lengths; squared errors in both sets, and of how many patterns and networks."""


def measuring_kernel(bounds: CommandBounds, networks: int, hidden: int, squashed: bool) -> Any:
    """Kernel for populations within these bounds; launch it on a grid (runs,) of at most `THREADS` threads.

    squashed: the networks' output is a sigmoid. Arguments as those of `bns.cuda.on_device.evolution`, with weights
    (runs, networks W) and the patterns to train on and to watch: X (2, runs, 5, capacity), targets
    (2, runs, networks, capacity) float32, NaN where a network does not learn from a pattern, counts (2, runs) int32;
    rows (runs, evaluations, 11) takes `MEASURED`.
    """
    low, high = bounds.low, bounds.high
    width, components = weight_count(hidden), len(bounds.low)
    foretold = squashed_output if squashed else output

    @cuda.jit(device=True)
    def squared_errors(w, X, targets, first, stride, n):  # type: ignore[no-untyped-def]  # compiled
        total, count = 0.0, 0
        for p in range(first, n, stride):
            for net in range(networks):
                target = np.float64(targets[net, p])
                if not math.isnan(target):
                    error = np.float64(foretold(w, net * width, width, X[0, p], X[1, p], X[2, p], X[3, p], X[4, p])) - target
                    total += error * error
                    count += 1
        return total, count

    @cuda.jit
    def measure(  # type: ignore[no-untyped-def]  # compiled
        evaluation, settings, weights, commands, lengths, used, fitness, order, X, targets, counts, failures, hits, rows
    ):
        sums = cuda.shared.array(_SUMS, float64)
        run, thread, threads = cuda.blockIdx.x, cuda.threadIdx.x, cuda.blockDim.x
        own = settings[run]
        if evaluation > own["evaluations"]:
            return
        n, done = own["population"], own["generations"] * evaluation
        some, long, needed, w = commands[done % 2, run], lengths[done % 2, run], used[run, :n], weights[run]
        for k in range(7):
            sums[k, thread] = 0.0
        for column in range(thread, own["longest"] * components, threads):
            j, c = column // components, column % components
            sums[0, thread] = spread(some, needed, j, c, 1.0 / (high[c] - low[c]), sums[0, thread])
        for i in range(thread, n, threads):
            sums[1, thread] += fitness[run, i]
            sums[2, thread] += long[i]
        for which in range(2):
            sums[3 + which, thread], sums[5 + which, thread] = squared_errors(
                w, X[which, run], targets[which, run], thread, threads, counts[which, run]
            )
        cuda.syncthreads()
        if thread > 0:
            return
        for other in range(1, threads):
            for k in range(7):
                sums[k, 0] += sums[k, other]
        row = rows[run, evaluation - 1]
        row[0], row[1], row[2] = sums[0, 0] / n, sums[1, 0] / n, fitness[run, order[run, 0]]
        for which in range(2):
            row[3 + which] = sums[3 + which, 0] / sums[5 + which, 0] if sums[5 + which, 0] > 0 else np.nan
            row[5 + which] = counts[which, run]
        row[7], row[8], row[9], row[10] = sums[2, 0] / n, done, hits[run], failures[run]

    return measure
