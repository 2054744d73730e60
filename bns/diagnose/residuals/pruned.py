"""What is left out again once all effects and terms are known: those of both that earn nothing beside the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.lacking import fit_without
from bns.diagnose.estimate.plausibility import implausible
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.significance import paired_elpd_diff
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.predict.base import Predictor
from bns.diagnose.residuals.along_variables import residual_dependence
from bns.diagnose.residuals.earned_terms import term_earns
from bns.diagnose.residuals.grammar import APART, PAST, RESPONSE, RESPONSE_OF, SHIFTS
from bns.diagnose.residuals.search_state import State
from bns.diagnose.residuals.symbolic import fitted
from bns.diagnose.residuals.unexplained import unexplained
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect
from bns.physics.model import Model

MIN_GAIN = DEFAULTS.select.min_gain
KEPT = DEFAULTS.residuals.kept_share
KEPT_TERM = DEFAULTS.residuals.kept_share_of_term


def pruned(predictor: Predictor, state: State, level: float, alone: Mapping[str, float] | None = None) -> State:
    """Without the effects that no longer earn their place beside what came in later, the least first.

    ``alone``: what each earns without terms; little beside them is then not enough (`KEPT`).
    """
    while state.names:
        lacking = state.lacking(state.names)
        worth = {name: state.problem.paired_comparison(one, state.fit) for name, one in lacking.items()}
        kept = {n: worth[n].elpd_diff / max(alone[n], 1e-9) if alone else worth[n].elpd_diff for n in state.names}
        least = min(kept, key=lambda name: kept[name])
        # as asked of a term: a model that lacks much may be off by so much in single trials that few are certain
        if term_earns(worth[least], lacking[least], level) and not (alone and kept[least] < KEPT):
            break
        state = state.without(predictor, least, lacking[least])
    while state.terms and (absurd := next((name for name in state.names if implausible(state.fit, name)), "")):
        # beside a curve no effect needs numbers that no robot has: it bends the curve
        state = state.without(predictor, absurd, fit_without(state.problem, state.fit, absurd))
    return state


def worth_alone(predictor: Predictor, given: Model, state: State) -> dict[str, float]:
    """What each effect earns in a model with the effects alone, without terms."""
    if not state.terms or not state.names:
        return {}
    model = state.fit.model
    for term in state.terms:
        model = model.without(term.name)
    problem = problem_for(predictor, model)
    fit = problem.fit(model)
    return {name: paired_elpd_diff(fit_without(problem, fit, name).held_out, fit.held_out)[0] for name in state.names}


def without_needless_terms(
    predictor: Predictor, state: State, accepted: Mapping[str, Effect], level: float
) -> State:
    """Without the terms that several accepted effects together do as well: a curve came in before it could be known.

    They do not where they leave something unexplained and the curve leaves nothing.
    """
    others = [effect for name, effect in accepted.items() if name not in state.names]
    for term in state.terms if others else ():
        model = state.fit.model.without(term.name)
        for effect in others:
            loose = problem_for(predictor, model)
            model = fit_with(loose, loose.fit(model), effect, state.known).model
        problem = problem_for(predictor, model, state.problem.pose_filter.noise)
        without = problem.fit(model)
        again = fitted(problem, without, term.on, term.term, term.name, term.signal, term.values)
        kept = again.paired_comparison.elpd_diff if again is not None else 0.0
        if kept < KEPT_TERM * term.paired_comparison.elpd_diff and not (
            _leaves_something(problem, without) and not _leaves_something(state.problem, state.fit)
        ):
            terms = tuple(one for one in state.terms if one.name != term.name)
            state = pruned(predictor, State(problem, without, tuple(accepted), terms, state.known), level)
    return state


def _leaves_something(problem: Problem, fit: Fit) -> bool:
    return unexplained(problem, fit, residual_dependence(problem, fit)).any


def without_idle_terms(predictor: Predictor, state: State, level: float) -> State:
    """Without the terms that earn nothing beside what came in after them, the least first; the last one stays.

    Nor may one earn on held-out trials what it does not in those that it was fitted to: a model without it may have a trial that
    rules it, and the one step that leaves this trial out then overshoots.
    """
    while len(state.terms) > 1:
        lacking = state.lacking([term.name for term in state.terms])
        fitted_share = {name: 1.0 - state.fit.loss / one.loss for name, one in lacking.items()}
        least = min(fitted_share, key=lambda name: fitted_share[name])
        comparison = state.problem.paired_comparison(lacking[least], state.fit)
        if fitted_share[least] > MIN_GAIN and term_earns(comparison, lacking[least], level):
            break
        others = tuple(term for term in state.terms if term.name != least)
        state = replace(state.settled(predictor, lacking[least]), terms=others)
    return state


def without_shifts(predictor: Predictor, given: Model, state: State) -> State:
    """Without the effects that a free response in time contains, however well they do beside its coarse steps.

    That is a shift of all motion in a response of both wheels, and one of the motion forwards against the turning (`APART`)
    in that of either.

    Beside any other free answer to past commands, without those that earn nothing in a model without terms, the least first: a
    late command and a clock that is early by as much make up for its steps together.
    """
    signals = {term.signal for term in state.terms}
    contained = (*(SHIFTS if RESPONSE in signals else ()), *(APART if signals.intersection(RESPONSE_OF.values()) else ()))
    for name in [shift for shift in contained if shift in state.names]:
        state = state.without(predictor, name, fit_without(state.problem, state.fit, name))
    while any(term.signal in PAST for term in state.terms) and not {*SHIFTS}.isdisjoint(state.names):
        worth = {name: gain for name, gain in worth_alone(predictor, given, state).items() if name in SHIFTS}
        least = min(worth, key=lambda name: worth[name])
        if worth[least] > MIN_GAIN * float(state.fit.held_out.mean()):
            break
        state = state.without(predictor, least, fit_without(state.problem, state.fit, least))
    return state
