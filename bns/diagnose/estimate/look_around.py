"""Is there a lower place beside where a fit ended? Where the loss has many small valleys, a fit ends in the first.

A body that is simulated bumps and slips a little differently at every value of a number: the loss of a stiffness went down by 17
from 0.76 to 0.70, over a rise of 2 between them. Likewise a wheel that crosses the rim of a patch of floor.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bns.diagnose.estimate.parameters import FreeParameter
from bns.diagnose.settings import DEFAULTS
from bns.physics.model import Model

_REACH = DEFAULTS.estimate.look_reach
_STEPS = DEFAULTS.estimate.look_steps
_BETTER = DEFAULTS.estimate.valley_better


def lower_place(loss_of: Callable[[Model], float], model: Model, free: Sequence[FreeParameter], loss: float) -> Model | None:
    """The model with one number moved to where the loss is lowest, if that is lower for certain than ``loss``; else None."""
    best, found = loss - _BETTER, None
    for number in free:
        p, value = number.parameter, number.of(model)
        for share in _REACH * np.linspace(-1, 1, 2 * _STEPS + 1):
            there = p.beside(value, float(share))
            if there == value:
                continue
            moved = model.with_values({number.effect: {**model.values_of(number.effect), p.name: there}})
            if (at := loss_of(moved)) < best:
                best, found = at, moved
    return found
