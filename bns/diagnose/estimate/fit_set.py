"""The fit of a model with a given set of effects, whatever order they are named in: `diagnose` and `add` both end here.

Effects are added one at a time, the one that lowers the loss most first; then each in turn is begun again from its own best
start, since what came in later may have left it in another valley. Noise and numbers are settled together at the end.
"""

from __future__ import annotations

from collections.abc import Sequence

from bns.diagnose.estimate.fit import Fit, Problem
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.predict.base import Predictor
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect
from bns.physics.model import Model

BETTER = DEFAULTS.estimate.valley_better
ROUNDS = DEFAULTS.estimate.set_rounds


def fit_set(
    predictor: Predictor, model: Model, effects: Sequence[Effect], known: Model | None = None
) -> tuple[Problem, Fit, tuple[str, ...]]:
    """The problem, the fit, and the names in the order in which they lowered the loss.

    ``known``: a model with the same effects whose numbers may be a better start; the better of both ends counts.
    """
    problem = problem_for(predictor, model)
    fit, left, order = problem.fit(model), {e.name: e for e in effects}, []
    while left:
        tried = {name: fit_with(problem, fit, effect) for name, effect in left.items()}
        best = min(tried, key=lambda name: (tried[name].loss, name))
        order.append(best)
        fit = tried[best]
        del left[best]
        problem = problem_for(predictor, fit.model, problem.pose_filter.noise)
        fit = problem.fit(fit.model)
    fit = _begun_again(problem, fit, effects)
    problem, fit = _settled(predictor, problem, fit)
    if known is not None:
        other = problem.fit(known)
        if other.loss < fit.loss - BETTER:
            problem, fit = _settled(predictor, problem, other)
    return problem, fit, tuple(order)


def _begun_again(problem: Problem, fit: Fit, effects: Sequence[Effect]) -> Fit:
    """Every effect of several from its own best start, beside the others as fitted."""
    for effect in effects if len(effects) > 1 else ():
        lacking = problem.fit(fit.model.without(effect.name), nearby=fit.jacobian_by_parameter)
        again = fit_with(problem, lacking, effect)
        if again.loss < fit.loss - BETTER:
            fit = again
    return fit


def _settled(predictor: Predictor, problem: Problem, fit: Fit) -> tuple[Problem, Fit]:
    for _ in range(ROUNDS):
        problem = problem_for(predictor, fit.model, problem.pose_filter.noise)
        fit = problem.fit(fit.model)
    return problem, fit
