"""The numbers of a model that are fitted, and how a model is moved along them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Parameter
from bns.physics.model import Model

_WIDE = DEFAULTS.estimate.wide_step


@dataclass(frozen=True)
class FreeParameter:
    """One number that is fitted: which effect's, and which."""

    effect: str
    parameter: Parameter

    def of(self, model: Model) -> float:
        """Its value in a model."""
        return model.values_of(self.effect)[self.parameter.name]


def moved_by(model: Model, free: Sequence[FreeParameter], step: Array) -> Model:
    """The model with its free numbers moved, held within their bounds."""
    values = {name: dict(model.values_of(name)) for name in {f.effect for f in free}}
    for number, change in zip(free, step, strict=True):
        p, of = number.parameter, values[number.effect]
        moved = float(of[p.name] + change)
        of[p.name] = p.low if moved < p.low else p.high if moved > p.high else moved
    return model.with_values(values)


def increment(number: FreeParameter, value: float) -> float:
    """A step for differences, turned round at the upper bound."""
    p = number.parameter
    usual = 1e-3 * (abs(value) if np.isinf(p.neutral) else p.plausible[1] - p.plausible[0])
    scale = p.resolution or usual
    return -scale if value + scale > p.high else scale


def increments(number: FreeParameter, value: float, wide: bool = False) -> list[float]:
    """Steps for differences: `increment`; or ``wide`` ones, to both sides as far as the bounds leave room for half of one."""
    p = number.parameter
    if not wide or not np.isfinite(p.plausible).all():
        return [increment(number, value)]
    ends = [p.beside(value, share) for share in (_WIDE, -_WIDE)]
    return [end - value for end in ends if p.apart(end, value) >= _WIDE / 2] or [increment(number, value)]


def active_mask(model: Model, free: Sequence[FreeParameter], gradient: Array) -> NDArray[np.bool_]:
    """Numbers that are not pressed against a bound by a gradient of the loss, (p,)."""
    pressed = [
        (f.of(model) <= f.parameter.low and slope > 0) or (f.of(model) >= f.parameter.high and slope < 0)
        for f, slope in zip(free, gradient, strict=True)
    ]
    return ~np.array(pressed, dtype=bool)
