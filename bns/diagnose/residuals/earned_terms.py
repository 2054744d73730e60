"""Free curves that earn their place beside a fitted model, written out as terms; whether they do better than an effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.significance import MIN_Z, PairedComparison, paired_elpd_diff
from bns.diagnose.residuals.grammar import PLACE, SPEED_THERE, STEPPED, Family, families, may_join
from bns.diagnose.residuals.ranked_families import Earned, certain, ranked, rounding, significant, simpler_first
from bns.diagnose.residuals.search_state import State
from bns.diagnose.residuals.symbolic import Formula, fitted, free_name, patch
from bns.diagnose.settings import DEFAULTS
from bns.physics.formula import SHARE

FALSE_ALARM = DEFAULTS.select.false_alarm
MIN_GAIN = DEFAULTS.select.min_gain
TERMS = DEFAULTS.residuals.flexible_terms
WHOLE = DEFAULTS.residuals.whole_rounding
CLEARLY = DEFAULTS.residuals.clearly_better


def left_over(problem: Problem, fit: Fit, response: bool = True) -> bool:
    """Is there a family that earns something beside a fitted model? ``response``: as `families` takes it."""
    return bool(curves_beside(problem, fit, families(problem.predictor, fit.model.wheelbase_m, response), ()))


def curve_does_better(problem: Problem, fit: Fit, added: Fit) -> bool:
    """Do flexible terms that earn their place predict better for certain than further effects, ``added``, do?

    As many terms as effects, at most `TERMS`; none against an effect that took another's place. Not asked where no terms are
    looked for: bodies on joints, single relative motions, trials with clocks of their own.
    """
    if problem.predictor.tracks.relative or fit.model.per_trial_effect is not None:
        return False
    grammar = families(problem.predictor, fit.model.wheelbase_m, False)
    level, state = FALSE_ALARM / max(len(grammar), 1), State(problem, fit)
    effects = len(added.model.effects) - len(fit.model.effects)
    if effects == 1:  # most curves are not clearly better already as they are estimated, and need not be fitted
        return better_term(problem, fit, curves_beside(problem, fit, grammar, ()), added, level) is not None
    for _ in range(min(effects, TERMS)):
        term = better_term(problem, state.fit, curves_beside(problem, state.fit, grammar, state.terms), None, level)
        if term is None:
            break
        state = replace(state, fit=term.fit, terms=(*state.terms, term))
    return _certainly_better(*paired_elpd_diff(added.held_out, state.fit.held_out), fit)


def better_term(
    problem: Problem, fit: Fit, curves: Sequence[Earned], effect: Fit | None, level: float
) -> Formula | None:
    """The first of the curves that can be written out and earns its place, while these are clearly better than the effect."""
    for curve in curves:
        if effect is not None and not _clearly_better(curve, effect, fit):
            break
        term = _written_out(problem, fit, curve.family)
        if term is not None and term_earns(term.paired_comparison, fit, level):
            return term
    return None


def curves_beside(problem: Problem, fit: Fit, grammar: Sequence[Family], terms: Sequence[Formula]) -> list[Earned]:
    """Families that are significant beside a model and its terms, the best first."""
    if len(terms) >= TERMS or not grammar:
        return []
    used = [(term.signal, term.on) for term in terms]
    found = significant(ranked(problem, fit, may_join(used, [*grammar, rounding(problem, fit)])))
    return simpler_first(found, float(fit.losses.mean()))


def _written_out(problem: Problem, fit: Fit, family: Family) -> Formula | None:
    """The family as a term; a round patch where it is a field over the floor and that does better."""
    name = free_name(fit.model)
    free = fitted(problem, fit, family.on, family.term, name, family.signal)
    over_floor = (family.signal, family.on) == (PLACE, SHARE) or family.signal == SPEED_THERE
    round_patch = patch(problem, fit, family.on, name) if over_floor else None
    found = [term for term in (free, round_patch) if term is not None and _whole(term)]
    return max(found, key=lambda term: term.paired_comparison.elpd_diff, default=None)


def _whole(term: Formula) -> bool:
    """Speeds come in steps or do not: half a rounding is something else."""
    return term.signal != STEPPED or abs(term.values["k0"] - 1.0) < WHOLE


def _clearly_better(curve: Earned, effect: Fit, fit: Fit) -> bool:
    return _certainly_better(*paired_elpd_diff(effect.held_out, curve.losses), fit)


def _certainly_better(gain: float, se: float, fit: Fit) -> bool:
    share = gain / float(fit.held_out.mean())
    return share > CLEARLY and certain(PairedComparison(gain, se, 0.0), share)


def term_earns(comparison: PairedComparison, before: Fit, level: float) -> bool:
    """Whether what a term gains is certain and enough."""
    share = comparison.elpd_diff / float(before.held_out.mean())
    return comparison.p_value < level and share > MIN_GAIN and certain(comparison, share)


def effect_earns(comparison: PairedComparison, before: Fit, level: float) -> bool:
    """Whether what an effect gains is certain in many trials and enough."""
    least = MIN_GAIN * float(before.held_out.mean())
    return comparison.p_value < level and comparison.z > MIN_Z and comparison.elpd_diff > least
