"""Where a search with flexible terms stands: the effects and the terms that came in, and the fit with all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.lacking import fit_without
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.parallel import each
from bns.diagnose.predict.base import Predictor
from bns.diagnose.residuals.symbolic import Formula
from bns.physics.effect import Effect
from bns.physics.model import Model


@dataclass(frozen=True)
class State:
    """A search between two steps; ``problem``: under the noise that goes with the fit."""

    problem: Problem
    fit: Fit
    names: tuple[str, ...] = ()
    terms: tuple[Formula, ...] = ()
    known: Model | None = None
    """The model that a search without terms ended in."""

    def lacking(self, names: Sequence[str]) -> dict[str, Fit]:
        """The fits without each of some effects or terms."""
        fits = each(partial(fit_without, self.problem, self.fit), names)
        return dict(zip(names, fits, strict=True))

    def without(self, predictor: Predictor, name: str, lacking: Fit) -> State:
        """The same without an effect; ``lacking``: fitted without it."""
        return replace(self.settled(predictor, lacking), names=tuple(n for n in self.names if n != name))

    def settled(self, predictor: Predictor, fit: Fit) -> State:
        """The same with a larger fit, its noise estimated again."""
        problem = problem_for(predictor, fit.model, self.problem.pose_filter.noise)
        return replace(self, problem=problem, fit=problem.fit(fit.model))


def tried_with(problem: Problem, fit: Fit, effects: Mapping[str, Effect], known: Model | None) -> dict[str, Fit]:
    """The fits with each of some effects added."""
    return dict(zip(effects, each(lambda one: fit_with(problem, fit, one, known), list(effects.values())), strict=True))
