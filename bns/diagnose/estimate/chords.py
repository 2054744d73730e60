"""The way from a model without an effect to a fit that has it: what each new number changes along it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.parameters import increment, moved_by
from bns.physics.model import Model


def chords(whitened: Callable[[Model], Array], added: Fit, new: Sequence[int]) -> Array:
    """Change of the whitened innovations for each new number on its whole way from neutral, (frames, 3, numbers).

    The way may be far from straight: where a silent joint bends no further its slope is 0, and its way is long; what a
    limit of the acceleration does where it was found says little of what it did on the way there from none.
    """
    out = []
    for j in new:
        number = added.free[j]
        neutral = number.parameter.neutral
        changed = 0.0 if added.values[j] == neutral else added.values[j] - neutral  # a limit may be infinite still
        if not np.isfinite(changed):
            changed, lacking = 1.0, whitened(added.model.without(number.effect))
        elif abs(changed) < abs(increment(number, added.values[j])):
            out.append(added.jacobian[..., j])
            continue
        else:
            lacking = whitened(moved_by(added.model, added.free, -changed * np.eye(len(added.free))[j]))
        way = (added.whitened - lacking) / changed
        out.append(way if np.abs(way).max() > 0 else added.jacobian[..., j])
    return np.stack(out, axis=2)


def reaching(way: Array, columns: Array) -> Array:
    """Directions (frames, 3, k) with the one most like ``way`` (frames, 3) replaced by it: they then lead to where the fit is.

    Near the base, and beside its numbers, this spans the same. Far from it the way is no sum of slopes: where a delay of 0.2 s
    gives way to one of 0.1 s with a lag, a box of speed goes, which the slope of neither can draw.
    """
    flat = columns.reshape(-1, columns.shape[-1])
    alike = np.abs(way.ravel() @ flat) / np.maximum(np.linalg.norm(flat, axis=0), 1e-30)
    out = columns.copy()
    out[..., int(np.argmax(alike))] = way
    return out
