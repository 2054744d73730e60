"""A fit without one of its effects, begun where what is left would take over."""

from __future__ import annotations

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.normal_equations import normal_equations
from bns.diagnose.estimate.parameters import moved_by
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.pseudo_inverse import pseudo_inverse
from bns.diagnose.settings import DEFAULTS

LOST = DEFAULTS.estimate.lacking_lost
BETTER = DEFAULTS.estimate.valley_better


def fit_without(problem: Problem, fit: Fit, name: str) -> Fit:
    """The model without an effect, all other numbers fitted.

    Where another term does the same as the effect, both may be large and of opposite sign. With the effect gone, the other's
    value is far from any data, a fit from there ends at once (its slopes are those of a filter that is lost), and the effect
    looks needed. So the fit begins at the better of two starts: the values of ``fit``, and those that minimise the quadratic
    form of the loss once the effect's numbers are neutral. If it ends much above the minimum of that form (`LOST`), it begins
    again under the larger noise of a model that is far off. Not so for bodies, whose noise comes from cycles.
    """
    bare, nearby = fit.model.without(name), fit.jacobian_by_parameter
    others, promised = _taken_over(fit, name)
    if others is None:
        return problem.fit(bare, nearby=nearby)
    kept = [number for number in fit.free if number.effect != name]
    start = min((bare, moved_by(bare, kept, others)), key=problem.loss)
    lacking = problem.fit(start, nearby=nearby)
    if problem.predictor.luck is not None or lacking.loss - fit.loss < LOST * max(promised, BETTER):
        return lacking
    again = problem.fit(problem_for(problem.predictor, start).fit(start).model)
    return min(lacking, again, key=lambda one: one.loss)


def _taken_over(fit: Fit, name: str) -> tuple[Array | None, float]:
    """By how much the other numbers move, and by how much the loss rises; None where the quadratic form says nothing of it."""
    own = np.array([number.effect == name for number in fit.free], dtype=bool)
    away = np.array([number.parameter.neutral for number in fit.free]) - fit.values
    if fit.model.per_trial_effect is not None or not own.any() or own.all() or not np.isfinite(away[own]).all():
        return None, 0.0
    curvature, _ = normal_equations(fit.jacobian, fit.whitened)
    shared, away = curvature[~own][:, own] @ away[own], away[own]
    others = -pseudo_inverse(curvature[~own][:, ~own]) @ shared
    return others, float(away @ curvature[own][:, own] @ away + others @ shared) / 2.0
