"""Numbers along which the loss has steps or kinks: the best value is searched for, and its interval comes from a bootstrap.

A threshold lies between two commands, a period between two changes of command, the rim of a patch between two tracks. Slopes
there, taken over a small change, say more or less by chance than the data do. So the loss of every trial is computed along the
number's profile (the other numbers follow to first order), and the trials are drawn again: the interval spans the values at
which the drawn trials' loss is least. For a smooth number this gives the jackknife's interval, which `Fit.covariance` has.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import huber
from bns.diagnose.estimate.parameters import increment, moved_by
from bns.diagnose.estimate.pseudo_inverse import pseudo_inverse
from bns.diagnose.settings import DEFAULTS

_POINTS = DEFAULTS.estimate.jagged_points
_ROUNDS = DEFAULTS.estimate.jagged_rounds
_EQUAL = DEFAULTS.estimate.jagged_equal
_DRAWS = DEFAULTS.predict.interval_draws
_SEED = DEFAULTS.predict.interval_seed
_WIDER, _EDGE, _NARROW = DEFAULTS.estimate.jagged_ranges


def with_jagged(problem: Problem, fit: Fit) -> Fit:
    """The fit with its jagged numbers at their best values, and with intervals for them; the same fit where it has none.

    A number that no pose depends on where it is has an interval, too, if it may be anything that is allowed: a limit that is not
    reached may be higher, but not lower.
    """
    jagged = [number for number in fit.free if number.parameter.jagged]
    idle = [j for j, number in enumerate(fit.free) if number.parameter.reached and _idle(fit, j)]
    if (not jagged and not idle) or problem.predictor.luck is not None:
        return fit
    own = {j: _as_good(problem, fit, j) for j in idle}
    spans: dict[int, tuple[float, float]] = {}
    for number in jagged:  # each at its best, given the best values of those before
        j = fit.free.index(number)
        if number.parameter.low < fit.values[j] < number.parameter.high:
            value, spans[j] = _searched(problem, fit, j)
            fit = _at(problem, fit, j, value)
    return replace(fit, spans={**{j: _hull(span, fit.interval(j)) for j, span in spans.items()}, **own})


def _idle(fit: Fit, j: int) -> bool:
    return bool(len(fit.jacobian)) and not fit.jacobian[..., j].any()


def _as_good(problem: Problem, fit: Fit, j: int) -> tuple[float, float]:
    """The interval of a number that does nothing where it is: of all that is allowed, what drawn trials cannot tell from it."""
    p, value = fit.free[j].parameter, float(fit.values[j])
    at = np.sort(np.append(np.linspace(p.low, p.high, _POINTS), value))
    alone = np.eye(len(fit.free))[j]
    low, high = _drawn(at, np.stack([_lowest(problem, fit, [(one - value) * alone]) for one in at]))
    return min(low, value), max(high, value)


def _hull(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    """Both: other numbers that are jagged, too, do not follow to first order, and slopes over a larger change see them."""
    return min(one[0], other[0]), max(one[1], other[1])


def _at(problem: Problem, fit: Fit, j: int, value: float) -> Fit:
    """The fit with that number at a value, and the others where they are best beside it."""
    moved = problem.fit(moved_by(fit.model, fit.free, (value - fit.values[j]) * followed(problem, fit, j)), rounds=0)
    stepped = problem.fit(moved_by(moved.model, moved.free, _best_of_others(problem, moved, j)), rounds=0)
    return min((moved, stepped), key=lambda one: one.loss)


def _best_of_others(problem: Problem, fit: Fit, j: int) -> Array:
    """One step of least squares of all numbers but one, (p,)."""
    by_trial = problem.normal_equations(fit.jacobian, fit.whitened)
    curvature, gradient = by_trial.curvatures.sum(axis=0), by_trial.gradients.sum(axis=0)
    curvature[j], curvature[:, j], gradient[j] = 0.0, 0.0, 0.0
    out: Array = -pseudo_inverse(curvature) @ gradient
    return out


def followed(problem: Problem, fit: Fit, j: int) -> Array:
    """By how much every number changes with a change of 1 of number j, (p,), the others following as least squares asks."""
    curvature = problem.normal_equations(fit.jacobian, fit.whitened).curvatures.sum(axis=0)
    others = np.arange(len(fit.free)) != j
    way = np.zeros(len(fit.free))
    way[j] = 1.0
    way[others] = -pseudo_inverse(curvature[np.ix_(others, others)]) @ curvature[others, j]
    return way


def _searched(problem: Problem, fit: Fit, j: int) -> tuple[float, tuple[float, float]]:
    """The best value of a number along its profile, and its 95 % interval."""
    p = fit.free[j].parameter
    ways = followed(problem, fit, j), np.eye(len(fit.free))[j]  # a slope that spans a step leads the others astray
    middle = float(fit.values[j])
    reach = 3.0 * max(fit.se(j), abs(increment(fit.free[j], middle)) / 10.0)
    value, low, high = middle, middle, middle
    for _ in range(_ROUNDS):
        at = np.clip(np.linspace(middle - reach, middle + reach, _POINTS), p.low, p.high)
        losses = np.stack([_lowest(problem, fit, [(v - fit.values[j]) * way for way in ways]) for v in at])
        value, low, high = _middle_of_least(at, losses.sum(axis=1)), *_drawn(at, losses)
        farthest = max(high - middle, middle - low)
        if farthest > _EDGE * reach:
            reach *= _WIDER
        elif farthest < _NARROW * reach:
            reach /= _WIDER
        else:
            break
        middle = value
    return value, (low, high)


def _lowest(problem: Problem, fit: Fit, steps: list[Array]) -> Array:
    """Losses (trials,) after that of these steps (p,) which leads to the least in all."""
    models = (moved_by(fit.model, fit.free, step) for step in steps)
    return min((problem.per_trial(huber(problem.whitened(model))) for model in models), key=lambda losses: float(losses.sum()))


def _middle_of_least(at: Array, losses: Array) -> float:
    """The middle of the values about the least loss that are as good as the best."""
    best = int(np.argmin(losses))
    worse = np.flatnonzero(losses > losses[best] + _EQUAL)
    low, high = worse[worse < best].max(initial=-1) + 1, worse[worse > best].min(initial=len(at)) - 1
    return float((at[low] + at[high]) / 2.0)


def _drawn(at: Array, losses: Array) -> tuple[float, float]:
    """Where the least loss of drawn trials lies in 95 of 100 draws; ``losses`` (values, trials).

    Of values that are equally good, the outermost count; the bend or step itself lies between them and the next ones.
    """
    summed = losses @ _draws(losses.shape[1]).T
    good, last = summed <= summed.min(axis=0) + _EQUAL, len(at) - 1
    low = at[np.maximum(good.argmax(axis=0) - 1, 0)]
    high = at[np.minimum(last - good[::-1].argmax(axis=0) + 1, last)]
    return float(np.quantile(low, 0.025)), float(np.quantile(high, 0.975))


@lru_cache(maxsize=4)
def _draws(trials: int) -> Array:
    """How often each trial is drawn, (draws, trials)."""
    drawn = np.random.default_rng(_SEED).multinomial(trials, np.full(trials, 1.0 / trials), size=_DRAWS)
    return drawn.astype(np.float64)
