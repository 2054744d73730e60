"""The last step of a fit of a body: each number where whole simulations, not curves between a few of them, say that it is best.

A search reads what a body does from curves, simulated at few values and in long steps (`predict/responses.py`). So its best value
is near the best one, and off by what the curves miss; and since every cycle bumps and slips a little differently at every value,
the loss has small valleys. Here the body itself is simulated at a few values to either side, the other numbers following to first
order; a parabola through these losses smooths the valleys out. Left out trials move its lowest point: that is the number's
standard error (the jackknife), in which the roughness has its share.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.special import stdtrit

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.jagged import followed
from bns.diagnose.estimate.noise import huber
from bns.diagnose.estimate.parameters import FreeParameter, moved_by
from bns.diagnose.estimate.significance import jackknife_covariance
from bns.diagnose.settings import DEFAULTS
from bns.physics.jointed.pieced import PiecedEffect
from bns.physics.model import Model

_STEP = DEFAULTS.estimate.profile_step
_POINTS = DEFAULTS.estimate.profile_points
_FARTHEST = DEFAULTS.estimate.profile_farthest
_BETTER = DEFAULTS.estimate.valley_better


def with_simulated_profiles(problem: Problem, fit: Fit) -> tuple[Fit, Model | None]:
    """The fit of a body with its numbers at the lowest points of their profiles, and with intervals from these.

    The same fit for every other robot. Numbers whose profile has no lowest point stay as they are, and so do those with which
    the simulated loss is no lower there. And None, or the model with a number as far off as it was simulated, where the loss is
    lower and still falls: the fit ended in another valley, and what follows from it is worth nothing.
    """
    if problem.predictor.luck is None:
        return fit, None
    effects = {active.effect.name: active.effect for active in fit.model.at("mechanics")}
    halves: dict[int, float] = {}
    for j, number in enumerate(fit.free):  # each at its best, given the best values of those before
        simulated = number.effect in effects and not isinstance(effects[number.effect], PiecedEffect)
        if simulated and np.isfinite(number.parameter.plausible).all():
            found = _searched(problem, fit, j)
            if isinstance(found, float):
                return fit, moved_by(fit.model, fit.free, (found - fit.values[j]) * followed(problem, fit, j))
            if found is not None:
                value, halves[j] = found
                way = (value - fit.values[j]) * followed(problem, fit, j)
                moved = moved_by(fit.model, fit.free, way)
                problem.predictor.anchor(moved)
                there = problem.fitted_at(moved)
                fit = there if there.loss < fit.loss else fit
    spans = {j: _around(fit.free[j], float(fit.values[j]), half) for j, half in halves.items()}
    return replace(fit, spans=spans), None


def _around(number: FreeParameter, value: float, half: float) -> tuple[float, float]:
    return number.parameter.beside(value, -half), number.parameter.beside(value, half)


def _searched(problem: Problem, fit: Fit, j: int) -> tuple[float, float] | float | None:
    """The lowest point of a number's profile, and half of its 95 % interval as a share of the plausible range; None: no such.

    A value alone: where the profile, simulated as far as it may be, still falls.
    """
    number, value = fit.free[j], float(fit.values[j])
    p, way = number.parameter, followed(problem, fit, j)
    step = max(_STEP, _share_of(number, value, fit.se(j)))
    losses: dict[float, Array] = {}

    def at(k: int) -> None:
        there = p.beside(value, k * step)
        share = float(np.sign(there - value)) * p.apart(there, value)
        if share not in losses:
            losses[share] = _simulated(problem, fit, (there - value) * way)

    for k in range(-(_POINTS // 2), _POINTS // 2 + 1):
        at(k)
    while (beyond := _outermost(losses)) and abs(round(beyond / step)) < _FARTHEST:
        known = len(losses)
        at(round(beyond / step) + int(np.sign(beyond)))
        if len(losses) == known:
            break
    if (end := _still_falling(losses)) is not None:
        return p.beside(value, end)
    lowest = _lowest(losses)
    if lowest is None:
        return None
    share, se = lowest
    middle = p.beside(value, share)
    freedom = max(len(fit.losses) - len(fit.free), 1)
    return middle, float(stdtrit(freedom, 0.975)) * max(se, _share_of(number, middle, fit.se(j)))


def _share_of(number: FreeParameter, value: float, change: float) -> float:
    """A change at a value as a share of the plausible range."""
    p = number.parameter
    ends = (p.apart(max(value - change, p.low), value), p.apart(min(value + change, p.high), value))
    return max(ends)


def _simulated(problem: Problem, fit: Fit, step: Array) -> Array:
    """Losses (trials,) with the numbers moved by ``step`` (p,), the body simulated there."""
    moved = moved_by(fit.model, fit.free, step)
    problem.predictor.anchor(moved, alone=True)
    return problem.per_trial(huber(problem.whitened_steps(problem.predictor.steps(moved))))


def _outermost(losses: Mapping[float, Array]) -> float | None:
    """The end (share) beside which the lowest loss lies, so that more must be simulated beyond it; None: there is none."""
    shares = sorted(losses)
    best = min(range(len(shares)), key=lambda i: float(losses[shares[i]].sum()))
    if 2 <= best < len(shares) - 2:
        return None
    return shares[0] if best < 2 else shares[-1]


def _still_falling(losses: Mapping[float, Array]) -> float | None:
    """The end (share) at which the loss is the least of all, and lower than where the number is now; None: it is at neither."""
    totals = {share: float(of.sum()) for share, of in losses.items()}
    least = min(totals, key=lambda share: totals[share])
    falls = least in (min(totals), max(totals)) and totals[least] < totals[0.0] - _BETTER
    return least if falls else None


def _lowest(losses: Mapping[float, Array]) -> tuple[float, float] | None:
    """The lowest point of the parabola through the losses about the least, and its standard error; None: it has none."""
    shares = np.array(sorted(losses))
    by_trial = np.array([losses[share] for share in shares])
    best, side = int(np.argmin(by_trial.sum(axis=1))), _POINTS // 2
    first = int(np.clip(best - side, 0, max(len(shares) - _POINTS, 0)))
    shares, by_trial = shares[first : first + _POINTS], by_trial[first : first + _POINTS]
    if len(shares) < 3:
        return None
    without = by_trial.sum(axis=1)[:, None] - by_trial
    fitted = np.polyfit(shares, np.column_stack([by_trial.sum(axis=1), without]), 2)
    if not (fitted[0] > 0).all():
        return None
    points = np.clip(-fitted[1] / (2 * fitted[0]), shares[0], shares[-1])
    return float(points[0]), float(np.sqrt(jackknife_covariance(points[1:, None])[0, 0]))
