"""The fit of a model with a given set of effects, whatever order they are named in: `diagnose` and `add` both end here.

Effects are added one at a time, the one that lowers the loss most first; then each in turn is begun again from its own best
start, since what came in later may have left it in another valley. Noise and numbers are settled together at the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.jagged import with_jagged
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.profiles import with_simulated_profiles
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.parallel import each
from bns.diagnose.predict.base import Predictor
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect
from bns.physics.model import Model

BETTER = DEFAULTS.estimate.valley_better
ROUNDS = DEFAULTS.estimate.set_rounds


class Tried:
    """What was tried on the way to sets of effects, by the effects that were in already, in their order.

    A ladder of n effects asks for its n first ones again at every step: remembered, the work grows with the square of n, not
    with the cube.
    """

    def __init__(self) -> None:
        self._reached: dict[tuple[Effect, ...], tuple[Problem, Fit]] = {}
        self._fits: dict[tuple[tuple[Effect, ...], Effect], Fit] = {}

    def reached(
        self, predictor: Predictor, model: Model, order: tuple[Effect, ...], noise: Array | None = None
    ) -> tuple[Problem, Fit]:
        """Problem and fit once these effects are in, noise and numbers settled; from ``model``."""
        if order not in self._reached:
            problem = problem_for(predictor, model, noise)
            self._reached[order] = problem, problem.fit(model)
        return self._reached[order]

    def fits(self, problem: Problem, fit: Fit, order: tuple[Effect, ...], left: Sequence[Effect]) -> list[Fit]:
        """The fit with each of the effects that are left, on all cores."""
        new = [effect for effect in left if (order, effect) not in self._fits]
        for effect, added in zip(new, each(partial(fit_with, problem, fit), new), strict=True):
            self._fits[order, effect] = added
        return [self._fits[order, effect] for effect in left]


def fit_set(
    predictor: Predictor,
    model: Model,
    effects: Sequence[Effect],
    known: Model | None = None,
    tried: Tried | None = None,
) -> tuple[Problem, Fit, tuple[str, ...]]:
    """The problem, the fit, and the names in the order in which they lowered the loss.

    What another of the effects contains is left out, for that one has its place. ``known``: a model with the same effects whose
    numbers may be a better start; the better of both ends counts. ``tried``: what earlier calls with the same predictor and model
    tried on the way; that of this one is added, and nothing is tried twice.
    """
    tried = Tried() if tried is None else tried
    inside = {name for effect in effects for name in effect.parts}
    effects = [effect for effect in effects if effect.name not in inside]
    order: tuple[Effect, ...] = ()
    problem, fit = tried.reached(predictor, model, order)
    while len(order) < len(effects):
        left = [effect for effect in effects if effect not in order]
        fits = dict(zip((e.name for e in left), tried.fits(problem, fit, order, left), strict=True))
        best = min(left, key=lambda effect: (fits[effect.name].loss, effect.name))
        order = (*order, best)
        problem, fit = tried.reached(predictor, fits[best.name].model, order, problem.pose_filter.noise)
    fit = _begun_again(problem, fit, effects)
    problem, fit = _settled(predictor, problem, fit)
    if known is not None:
        other = problem.fit(known)
        if other.loss < fit.loss - BETTER:
            problem, fit = _settled(predictor, problem, other)
    problem, fit = _in_the_lowest_valley(predictor, problem, with_jagged(problem, fit))
    return problem, fit, tuple(effect.name for effect in order)


def _in_the_lowest_valley(predictor: Predictor, problem: Problem, fit: Fit) -> tuple[Problem, Fit]:
    """The fit of a body with its profiles simulated; where these show a lower minimum, noise and parameters are fitted again."""
    for _ in range(ROUNDS):
        profiled, lower = with_simulated_profiles(problem, fit)
        if lower is None:
            return problem, profiled
        problem, fit = _settled(predictor, problem, problem.fit(lower))
    return problem, with_simulated_profiles(problem, fit)[0]


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
