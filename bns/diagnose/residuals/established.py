"""Which accepted effects stand, where something is left that no effect of the list explains; and what that looks like.

What is left biases all that is fitted without it, and listed effects are accepted because they imitate it. So the search is
done again with flexible terms (`grammar`) as candidates beside the accepted effects, on equal terms: whatever predicts trials
held out best comes in first; an effect is preferred to a free curve only if the curve is not better for certain. In the end
the model with the terms must predict held-out trials significantly better with each effect, at the level that all candidates
share. A curve that can reproduce an effect leaves it nothing to explain, even if the effect is real: where an effect explains
nearly all that its term does, the effect is kept.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.plausibility import implausible
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.base import Predictor
from bns.diagnose.residuals.earned_terms import better_term, curves_beside, effect_earns
from bns.diagnose.residuals.grammar import PAST, Family, families
from bns.diagnose.residuals.pruned import (
    pruned,
    without_idle_terms,
    without_needless_terms,
    without_shifts,
    worth_alone,
)
from bns.diagnose.residuals.restored import restored
from bns.diagnose.residuals.search_state import State, tried_with
from bns.diagnose.residuals.symbolic import Formula
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect
from bns.physics.model import Model

FALSE_ALARM = DEFAULTS.select.false_alarm
TERMS = DEFAULTS.residuals.flexible_terms


@dataclass(frozen=True)
class Established:
    """Effects that stand beside the terms, the terms, and the fit with all of them."""

    names: tuple[str, ...]
    terms: tuple[Formula, ...]
    problem: Problem
    fit: Fit


def established(
    predictor: Predictor,
    given: Model,
    accepted: Mapping[str, Effect],
    response: bool | None = None,
    known: Model | None = None,
    past: bool = True,
    others: Mapping[str, Effect] | None = None,
) -> Established:
    """The search with flexible terms; ``accepted``: the effects that a search without them ended in, ``known``: with its numbers.

    ``response``: is the wheels' free response a candidate; by default where no effect was accepted. ``past``: is any answer to
    past commands. ``others``: effects that were not accepted; what hid them may be in a term.
    """
    problem = problem_for(predictor, given)
    state, left = State(problem, problem.fit(given), known=known), dict(accepted)
    grammar = families(predictor, given.wheelbase_m, not accepted if response is None else response)
    grammar = grammar if past else [family for family in grammar if family.signal not in PAST]
    level = FALSE_ALARM / max(len(left) + len(grammar), 1)
    for _ in range(len(accepted) + TERMS):
        following = _step(predictor, state, left, grammar, level, others or {})
        if following is None:
            break
        state = following
        left = {name: effect for name, effect in left.items() if name not in state.names}
    state = pruned(predictor, state, level)
    state = without_needless_terms(predictor, state, accepted, level)
    state = pruned(predictor, state, level, worth_alone(predictor, given, state))
    state = without_shifts(predictor, given, restored(predictor, state, accepted, level))
    state = without_idle_terms(predictor, state, level)
    terms = tuple(replace(term, fit=state.fit) for term in state.terms)
    return Established(state.names, terms, state.problem, state.fit)


def _step(
    predictor: Predictor,
    state: State,
    left: Mapping[str, Effect],
    grammar: Sequence[Family],
    level: float,
    others: Mapping[str, Effect],
) -> State | None:
    """The best effect or term added; None where neither earns anything.

    Beside one term no second one comes in where one of the ``others`` predicts as well with fewer numbers: the first term had
    hidden it. Beside more terms an effect would imitate what these fail to describe.
    """
    problem, fit = state.problem, state.fit
    tried = tried_with(problem, fit, left, state.known)
    earned = {name: one for name, one in tried.items() if effect_earns(problem.paired_comparison(fit, one), fit, level)}
    best = min(earned, key=lambda name: float(earned[name].held_out.sum()), default="")
    curves = curves_beside(problem, fit, grammar, state.terms)
    term = better_term(problem, fit, curves, earned.get(best), level)
    if term is not None:
        name, added = _in_its_place(problem, fit, term, others) if len(state.terms) == 1 else ("", fit)
        if name:
            return replace(state.settled(predictor, added), names=(*state.names, name))
        return replace(state.settled(predictor, term.fit), terms=(*state.terms, term))
    if not best:
        return None
    return replace(state.settled(predictor, earned[best]), names=(*state.names, best))


def _in_its_place(problem: Problem, fit: Fit, term: Formula, others: Mapping[str, Effect]) -> tuple[str, Fit]:
    """The effect that has fewer numbers than a term and predicts trials held out as well, and its fit; "" if none does."""
    level = FALSE_ALARM / max(len(others), 1)
    known = {active.effect.name for active in fit.model.effects}
    tried = tried_with(problem, fit, {name: effect for name, effect in others.items() if name not in known}, None)
    as_good = {
        name: one
        for name, one in tried.items()
        if len(one.free) < len(term.fit.free)
        and float(one.held_out.sum()) <= float(term.fit.held_out.sum())
        and not implausible(one, name)
        and effect_earns(problem.paired_comparison(fit, one), fit, level)
    }
    best = min(as_good, key=lambda name: float(as_good[name].held_out.sum()), default="")
    return best, as_good.get(best, fit)
