"""What may be missing: every listed effect and every decoy, each fitted from the most promising of several starts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product

import numpy as np

from bns.diagnose.estimate.fit import Fit, Problem, StartingPoint
from bns.physics.effect import Effect, Parameter
from bns.physics.effects import all_effects
from bns.physics.model import Model

_SHARES = (0.01, 0.05, 0.2)
"""Starts of an ordinary number: these shares of the way from neutral to either end of what is plausible."""
NOTHING = 5e-3
"""A gain of fewer trials' losses than this, over all trials, is not worth a fit: it would not count (`stepwise.MIN_GAIN`)."""
_LIMITS = 30
"""Starts of a number that is neutral at infinity: so many, evenly spaced on a logarithmic scale."""


def listed(model: Model, extra: Mapping[str, Effect] | None = None) -> dict[str, Effect]:
    """Name -> effect that the model does not have yet, from the catalogue and from ``extra``."""
    present = {active.effect.name for active in model.effects}
    everything = {**all_effects(), **(extra or {})}
    return {name: effect for name, effect in everything.items() if name not in present}


def fit_with(problem: Problem, base: Fit, effect: Effect) -> Fit:
    """The model with that effect, all numbers fitted; from the best of the effect's starts.

    An effect that earns next to nothing there is not followed further: the answer would be the same.
    """
    start = best_start(problem, base, effect)
    hopeless = base.loss - start.loss < NOTHING * base.loss / len(base.losses)
    return problem.fit(start.model, 0 if hopeless else None, start.jacobian_by_parameter)


def best_start(problem: Problem, base: Fit, effect: Effect) -> StartingPoint:
    """The fitted model with the effect at the most promising of its starts, one step of least squares taken."""
    starts = [base.model.with_active(effect, values) for values in _starts(effect)]
    losses = [problem.loss(start) for start in starts]
    best = int(np.argmin(losses))
    stepped = problem.gauss_newton_step(starts[best], base)
    return stepped if stepped.loss < losses[best] else replace(stepped, model=starts[best], loss=losses[best])


def _starts(effect: Effect) -> Iterator[tuple[float, ...]]:
    if effect.starts:
        yield from effect.starts
        return
    grids = [list(_grid(p)) for p in effect.parameters]
    if len(grids) == 2:  # along each axis: the effect of two numbers is nearly the sum of both
        neutral = tuple(effect.neutral.values())
        for axis in range(2):
            for value in grids[axis]:
                yield tuple(value if i == axis else n for i, n in enumerate(neutral))
    else:
        yield from product(*grids)


def _grid(p: Parameter) -> Iterator[float]:
    low, high = p.plausible
    if np.isinf(p.neutral):
        yield from (float(v) for v in np.geomspace(low, high, _LIMITS))
        return
    for end in (low, high):
        yield from (p.neutral + share * (end - p.neutral) for share in _SHARES if end != p.neutral)
