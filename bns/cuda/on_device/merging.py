"""Patterns of the same inputs as one, for robots that repeat themselves: one block a run."""

from __future__ import annotations

from numba import cuda, int32

from bns.engine.snn import INPUTS

_ONE = (1,)


@cuda.jit
def merge(  # type: ignore[no-untyped-def]  # compiled
    evaluation, settings, X, targets, counts, merged, inputs, sums, means, times, distinct
):
    """Take the patterns that came since the last time into the distinct ones, as `bns.engine.patterns.PatternSet.merged` does.

    X (runs, 5, capacity), targets (runs, networks, capacity), NaN where a network does not learn from a pattern, counts
    (runs,): all patterns; merged (runs,): how many of them are taken in. inputs (runs, 5, most): the distinct ones; sums
    (float64), means and times (runs, networks, most): of their targets, and how many each stands for; distinct (runs,): how many
    distinct ones there are.
    """
    found = cuda.shared.array(_ONE, int32)
    run, thread, threads = cuda.blockIdx.x, cuda.threadIdx.x, cuda.blockDim.x
    if evaluation > settings[run]["evaluations"]:
        return
    begin, end = merged[run], counts[run]
    cuda.syncthreads()
    for p in range(begin, end):
        known = distinct[run]
        if thread == 0:
            found[0] = known
        cuda.syncthreads()
        for q in range(thread, known, threads):
            same = True
            for k in range(INPUTS):
                same = same and inputs[run, k, q] == X[run, k, p]
            if same:
                found[0] = q  # one at most: they are distinct
        cuda.syncthreads()
        at = found[0]
        for net in range(thread, targets.shape[1], threads):
            target = targets[run, net, p]
            learned = target == target  # noqa: PLR0124  # NaN is not
            total = sums[run, net, at] if at < known else 0.0
            often = times[run, net, at] if at < known else 0.0
            if learned:
                total, often = total + target, often + 1.0
            sums[run, net, at] = total
            times[run, net, at] = often
            means[run, net, at] = total / often if often > 0 else 0.0
        cuda.syncthreads()
        if thread == 0 and at == known:
            for k in range(INPUTS):
                inputs[run, k, at] = X[run, k, p]
            distinct[run] = at + 1
        cuda.syncthreads()
    if thread == 0:
        merged[run] = end
