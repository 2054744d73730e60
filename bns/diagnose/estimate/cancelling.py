"""Effects and free terms that cancel in part: what a term for the rest does to the numbers found without it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Parameter

OUTGROWN = DEFAULTS.verdict.outgrown


class Cancelled(NamedTuple):
    """An effect of one number: its value without a term and with one that it cancels in part."""

    name: str
    parameter: Parameter
    without: float
    beside: float


def cancelled(without: Fit, beside: Fit, accepted: Sequence[str]) -> Iterator[Cancelled]:
    """Effects of one number that a term takes certainly to the other side of neutral, or certainly much further from it.

    ``without``, ``beside``: fits without the term and with it. By the ends of 95 % intervals.
    """
    before, after = _only_numbers(without), _only_numbers(beside)
    for name in accepted:
        if name in before and name in after:
            (p, value, low, high), (_, value_beside, low_beside, high_beside) = before[name], after[name]
            turned = max(low, low_beside) > 0.0 > min(high, high_beside)
            within = low_beside <= 0.0 <= high_beside
            least = 0.0 if within else min(abs(low_beside), abs(high_beside))
            if turned or least > OUTGROWN * max(abs(low), abs(high)):
                yield Cancelled(name, p, value, value_beside)


def _only_numbers(fit: Fit) -> dict[str, tuple[Parameter, float, float, float]]:
    """Of effects with one fitted number: which, its value, and the ends of its interval from neutral."""
    each: dict[str, list[int]] = {}
    for index, number in enumerate(fit.free):
        each.setdefault(number.effect, []).append(index)
    found = {}
    for name, indices in each.items():
        p = fit.free[indices[0]].parameter
        if len(indices) == 1 and np.isfinite(p.neutral):
            low, high = (end - p.neutral for end in fit.interval(indices[0]))
            found[name] = p, float(fit.values[indices[0]]), low, high
    return found
