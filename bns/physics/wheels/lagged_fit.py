"""Running sums along a trial, and sums for least squares of their differences over a lag; compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bns.engine.jit import exact
from bns.physics.signals import Array


@exact
def lagged_sums(columns: Array, off: Array, used: NDArray[np.bool_], lag: int) -> tuple[Array, Array, Array]:
    """Normal equations of ``off`` (trials, steps) by ``columns`` (trials, steps, k), both as differences over ``lag`` steps.

    Returns the products of the columns (trials, k, k), of the columns and ``off`` (trials, k), and the number of differences
    (trials,); one counts where both of its steps are ``used``.
    """
    trials, steps, k = columns.shape
    gram, target, count = np.zeros((trials, k, k)), np.zeros((trials, k)), np.zeros(trials)
    change = np.empty(k)
    for row in range(trials):
        for t in range(lag, steps):
            if not (used[row, t] and used[row, t - lag]):
                continue
            count[row] += 1.0
            e = off[row, t] - off[row, t - lag]
            for i in range(k):
                change[i] = columns[row, t, i] - columns[row, t - lag, i]
                target[row, i] += change[i] * e
                for j in range(i + 1):
                    gram[row, i, j] += change[i] * change[j]
        for i in range(k):
            for j in range(i):
                gram[row, j, i] = gram[row, i, j]
    return gram, target, count


@exact
def lagged_rest(
    columns: Array, off: Array, used: NDArray[np.bool_], lag: int, values: Array, most: int
) -> tuple[Array, Array, Array]:
    """What coefficients ``values`` (trials, k) leave of the differences: the sum of squares (trials,), and over all trials the
    sums of its products with itself 0 to ``most`` steps on, and how many products these are, (most + 1,) each."""
    trials, steps, k = columns.shape
    left, product, pairs = np.zeros(trials), np.zeros(most + 1), np.zeros(most + 1)
    rest, there = np.zeros(max(steps - lag, 0)), np.zeros(max(steps - lag, 0))
    for row in range(trials):
        for t in range(lag, steps):
            at = t - lag
            rest[at] = there[at] = 0.0
            if used[row, t] and used[row, at]:
                e = off[row, t] - off[row, at]
                for i in range(k):
                    e -= (columns[row, t, i] - columns[row, at, i]) * values[row, i]
                rest[at], there[at] = e, 1.0
                left[row] += e * e
        for apart in range(min(most + 1, len(rest))):
            for at in range(len(rest) - apart):
                product[apart] += rest[at] * rest[at + apart]
                pairs[apart] += there[at] * there[at + apart]
    return left, product, pairs


@exact
def led_to(rates: Array, others: Array, step_s: Array) -> Array:
    """What rates (k, trials, steps) lead to in the middle of each step, and m ``others`` as they are: (trials, steps, k + m)."""
    k, trials, steps = rates.shape
    out = np.empty((trials, steps, k + others.shape[0]))
    for row in range(trials):
        for i in range(k):
            way = 0.0
            for t in range(steps):
                half = rates[i, row, t] * step_s[row, t] / 2.0
                out[row, t, i] = way + half
                way += 2.0 * half
        for i in range(others.shape[0]):
            for t in range(steps):
                out[row, t, k + i] = others[i, row, t]
    return out
