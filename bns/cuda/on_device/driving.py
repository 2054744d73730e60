"""What the kernels that drive a controller have in common, whatever the robot: who drives, noise, and where patterns go."""

from __future__ import annotations

import math

import numpy as np
from numba import cuda

from bns.engine.breeding import winner
from bns.engine.patterns import TRAINING_SHARE
from bns.engine.philox import Purpose, philox
from bns.engine.snn import INPUTS

_PICK, _SPLIT, _FIRST = np.uint32(Purpose.PICK), np.uint32(Purpose.SPLIT), np.uint32(0)
_UNIT = 2.0**-32


@cuda.jit(device=True)
def chosen(own, learning, order, cdf, step):  # type: ignore[no-untyped-def]  # compiled
    """Who drives: while ``learning`` the winner of the tournament for the real world, else the fittest."""
    if learning:
        return winner(order, cdf, philox(_FIRST, _FIRST, step, _PICK, own["key0"], own["key1"])[0])
    return order[0]


@cuda.jit(device=True)
def normals_of(draws):  # type: ignore[no-untyped-def]  # compiled
    """Four standard normal numbers of four words, by Box and Muller, as `bns.engine.philox.normals`."""
    one = math.sqrt(-2.0 * math.log((draws[0] + 0.5) * _UNIT))
    other = math.sqrt(-2.0 * math.log((draws[2] + 0.5) * _UNIT))
    first, second = (draws[1] + 0.5) * (_UNIT * 2.0 * math.pi), (draws[3] + 0.5) * (_UNIT * 2.0 * math.pi)
    return one * math.cos(first), other * math.cos(second), one * math.sin(first), other * math.sin(second)


@cuda.jit(device=True)
def keep(inputs, target, absent, j, own, step, run, X, targets, counts):  # type: ignore[no-untyped-def]  # compiled
    """Add the pattern of the j-th command driven to one of two sets, at random; 1 if it is not finite, and left out.

    The first ``absent`` networks do not learn from it: NaN stands for their targets. Arrays as in `bns.cuda.batch`.
    """
    for net in range(targets.shape[2]):
        if not math.isfinite(target[net]):
            return 1
    to_training = philox(np.uint32(j), _FIRST, step, _SPLIT, own["key0"], own["key1"])[0] * _UNIT < TRAINING_SHARE
    which = 0 if to_training else 1
    at = counts[which, run]
    for k in range(INPUTS):
        X[which, run, k, at] = inputs[k]
    for net in range(targets.shape[2]):
        targets[which, run, net, at] = np.float32(math.nan) if net < absent else target[net]
    counts[which, run] = at + 1
    return 0
