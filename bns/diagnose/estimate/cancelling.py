"""Effects and free terms that cancel in part: what a term for the rest does to the numbers found without it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Parameter
from bns.physics.figures import with_unit

OUTGROWN = DEFAULTS.verdict.outgrown


class Cancelled(NamedTuple):
    """An effect of one size: its value without a term and beside one. They cancel in part, or (``divided``) share the work."""

    name: str
    parameter: Parameter
    without: float
    beside: float
    divided: bool = False

    @property
    def in_words(self) -> str:
        """A sentence or two with both numbers."""
        name, p = self.name, self.parameter
        beside = f"{self.beside:.3g}{with_unit(p.unit)}"
        numbers = f"with the term in the model, {p.name} is {beside}, and {self.without:.3g} without it"
        if self.divided:
            return (
                f"{name} and the free term each describe a part of the same delay: {numbers}. Only both together are determined: "
                f"do not read {p.name} by itself."
            )
        return (
            f"{name} and the free term cancel in part: {numbers}. What acts may be neither of the two, but something that only "
            f"both together describe (such as friction that changes along the session): do not read {p.name} by itself."
        )


def cancelled(without: Fit, beside: Fit, accepted: Sequence[str], past: bool = False) -> Iterator[Cancelled]:
    """Effects of one size that a term takes certainly to the other side of neutral, or certainly much further from it.

    ``without``, ``beside``: fits without the term and with it. By the ends of 95 % intervals. ``past``: is it an answer to past
    commands? Such a term contains lags: how much of one is in the effect, and how much in the term, is then nobody's property
    of the robot, so effects that it takes certainly much nearer to neutral count, too.
    """
    before, after = _sizes(without), _sizes(beside)
    for name in accepted:
        if name in before and name in after:
            (p, value, low, high), (_, value_beside, low_beside, high_beside) = before[name], after[name]
            turned = max(low, low_beside) > 0.0 > min(high, high_beside)
            within = low_beside <= 0.0 <= high_beside
            least = 0.0 if within else min(abs(low_beside), abs(high_beside))
            least_before = 0.0 if low <= 0.0 <= high else min(abs(low), abs(high))
            divided = past and not turned and OUTGROWN * max(abs(low_beside), abs(high_beside)) < least_before
            if turned or divided or least > OUTGROWN * max(abs(low), abs(high)):
                yield Cancelled(name, p, value, value_beside, divided)


def _sizes(fit: Fit) -> dict[str, tuple[Parameter, float, float, float]]:
    """Of effects with one size, by name: which number it is, its value, and the ends of its interval from neutral.

    That is an only number, or the only one that is no multiple of another: a lag is, and how often it is as long in turns is not.
    """
    each: dict[str, list[int]] = {}
    for index, number in enumerate(fit.free):
        each.setdefault(number.effect, []).append(index)
    found = {}
    for name, indices in each.items():
        sizes = indices if len(indices) == 1 else [i for i in indices if not fit.free[i].parameter.is_multiple]
        if len(sizes) == 1 and np.isfinite((p := fit.free[sizes[0]].parameter).neutral):
            low, high = (end - p.neutral for end in fit.interval(sizes[0]))
            found[name] = p, float(fit.values[sizes[0]]), low, high
    return found
