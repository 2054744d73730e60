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
from functools import partial

from bns.diagnose.estimate.cross_validation import held_out_steps
from bns.diagnose.estimate.fit import Fit, Problem
from bns.diagnose.estimate.lacking import fit_without
from bns.diagnose.estimate.plausibility import implausible
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.significance import MIN_Z, PairedComparison, paired_elpd_diff
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.parallel import each
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.paired_errors import paired_errors
from bns.diagnose.residuals.along_variables import residual_dependence
from bns.diagnose.residuals.grammar import (
    PAST,
    PLACE,
    RESPONSE,
    SHIFTS,
    SPEED_THERE,
    STEPPED,
    Earned,
    Family,
    certain,
    families,
    may_join,
    ranked,
    rounding,
    significant,
    simpler_first,
)
from bns.diagnose.residuals.symbolic import Formula, fitted, free_name, patch
from bns.diagnose.residuals.unexplained import unexplained
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect
from bns.physics.formula import SHARE
from bns.physics.model import Model

FALSE_ALARM = DEFAULTS.select.false_alarm
MIN_GAIN = DEFAULTS.select.min_gain
TERMS = DEFAULTS.residuals.flexible_terms
KEPT = DEFAULTS.residuals.kept_share
KEPT_TERM = DEFAULTS.residuals.kept_share_of_term
SPANNED = DEFAULTS.residuals.spanned_share
WHOLE = DEFAULTS.residuals.whole_rounding
CLEARLY = DEFAULTS.residuals.clearly_better


@dataclass(frozen=True)
class Established:
    """Effects that stand beside the terms, the terms, and the fit with all of them."""

    names: tuple[str, ...]
    terms: tuple[Formula, ...]
    problem: Problem
    fit: Fit


@dataclass(frozen=True)
class _State:
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

    def without(self, predictor: Predictor, name: str, lacking: Fit) -> _State:
        """The same without an effect; ``lacking``: fitted without it."""
        return replace(self.settled(predictor, lacking), names=tuple(n for n in self.names if n != name))

    def settled(self, predictor: Predictor, fit: Fit) -> _State:
        """The same with a larger fit, its noise estimated again."""
        problem = problem_for(predictor, fit.model, self.problem.pose_filter.noise)
        return replace(self, problem=problem, fit=problem.fit(fit.model))


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
    state, left = _State(problem, problem.fit(given), known=known), dict(accepted)
    grammar = families(predictor, given.wheelbase_m, not accepted if response is None else response)
    grammar = grammar if past else [family for family in grammar if family.signal not in PAST]
    level = FALSE_ALARM / max(len(left) + len(grammar), 1)
    for _ in range(len(accepted) + TERMS):
        following = _step(predictor, state, left, grammar, level, others or {})
        if following is None:
            break
        state = following
        left = {name: effect for name, effect in left.items() if name not in state.names}
    state = _pruned(predictor, state, level)
    state = _without_needless_terms(predictor, state, accepted, level)
    state = _pruned(predictor, state, level, _alone(predictor, given, state))
    state = _without_shifts(predictor, given, _restored(predictor, state, accepted, level))
    state = _without_idle_terms(predictor, state, level)
    terms = tuple(replace(term, fit=state.fit) for term in state.terms)
    return Established(state.names, terms, state.problem, state.fit)


def left_over(problem: Problem, fit: Fit, response: bool = True) -> bool:
    """Is there a family that earns something beside a fitted model? ``response``: as `families` takes it."""
    return bool(_curves(problem, fit, families(problem.predictor, fit.model.wheelbase_m, response), ()))


def curve_does_better(problem: Problem, fit: Fit, added: Fit) -> bool:
    """Do flexible terms that earn their place predict better for certain than further effects, ``added``, do?

    As many terms as effects, at most `TERMS`; none against an effect that took another's place. Not asked where no terms are
    looked for: bodies on joints, single relative motions, trials with clocks of their own.
    """
    if problem.predictor.tracks.relative or fit.model.per_trial_effect is not None:
        return False
    grammar = families(problem.predictor, fit.model.wheelbase_m, False)
    level, state = FALSE_ALARM / max(len(grammar), 1), _State(problem, fit)
    effects = len(added.model.effects) - len(fit.model.effects)
    if effects == 1:  # most curves are not clearly better already as they are estimated, and need not be fitted
        return _better_term(problem, fit, _curves(problem, fit, grammar, ()), added, level) is not None
    for _ in range(min(effects, TERMS)):
        term = _better_term(problem, state.fit, _curves(problem, state.fit, grammar, state.terms), None, level)
        if term is None:
            break
        state = replace(state, fit=term.fit, terms=(*state.terms, term))
    return _certainly_better(*paired_elpd_diff(added.held_out, state.fit.held_out), fit)


def _better_term(
    problem: Problem, fit: Fit, curves: Sequence[Earned], effect: Fit | None, level: float
) -> Formula | None:
    """The first of the curves that can be written out and earns its place, while these are clearly better than the effect."""
    for curve in curves:
        if effect is not None and not _clearly_better(curve, effect, fit):
            break
        term = _written_out(problem, fit, curve.family)
        if term is not None and _term_earns(term.paired_comparison, fit, level):
            return term
    return None


def _step(
    predictor: Predictor,
    state: _State,
    left: Mapping[str, Effect],
    grammar: Sequence[Family],
    level: float,
    others: Mapping[str, Effect],
) -> _State | None:
    """The best effect or term added; None where neither earns anything.

    Beside one term no second one comes in where one of the ``others`` predicts as well with fewer numbers: the first term had
    hidden it. Beside more terms an effect would imitate what these fail to describe.
    """
    problem, fit = state.problem, state.fit
    tried = _tried(problem, fit, left, state.known)
    earned = {name: one for name, one in tried.items() if _earns(problem.paired_comparison(fit, one), fit, level)}
    best = min(earned, key=lambda name: float(earned[name].held_out.sum()), default="")
    curves = _curves(problem, fit, grammar, state.terms)
    term = _better_term(problem, fit, curves, earned.get(best), level)
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
    tried = _tried(problem, fit, {name: effect for name, effect in others.items() if name not in known}, None)
    as_good = {
        name: one
        for name, one in tried.items()
        if len(one.free) < len(term.fit.free)
        and float(one.held_out.sum()) <= float(term.fit.held_out.sum())
        and not implausible(one, name)
        and _earns(problem.paired_comparison(fit, one), fit, level)
    }
    best = min(as_good, key=lambda name: float(as_good[name].held_out.sum()), default="")
    return best, as_good.get(best, fit)


def _tried(problem: Problem, fit: Fit, effects: Mapping[str, Effect], known: Model | None) -> dict[str, Fit]:
    """The fits with each of some effects added."""
    return dict(zip(effects, each(lambda one: fit_with(problem, fit, one, known), list(effects.values())), strict=True))


def _curves(problem: Problem, fit: Fit, grammar: Sequence[Family], terms: Sequence[Formula]) -> list[Earned]:
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


def _term_earns(comparison: PairedComparison, before: Fit, level: float) -> bool:
    share = comparison.elpd_diff / float(before.held_out.mean())
    return comparison.p_value < level and share > MIN_GAIN and certain(comparison, share)


def _earns(comparison: PairedComparison, before: Fit, level: float) -> bool:
    least = MIN_GAIN * float(before.held_out.mean())
    return comparison.p_value < level and comparison.z > MIN_Z and comparison.elpd_diff > least


def _without_needless_terms(
    predictor: Predictor, state: _State, accepted: Mapping[str, Effect], level: float
) -> _State:
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
            state = _pruned(predictor, _State(problem, without, tuple(accepted), terms, state.known), level)
    return state


def _without_idle_terms(predictor: Predictor, state: _State, level: float) -> _State:
    """Without the terms that earn nothing beside what came in after them, the least first; the last one stays.

    Nor may one earn on held-out trials what it does not in those that it was fitted to: a model without it may have a trial that
    rules it, and the one step that leaves this trial out then overshoots.
    """
    while len(state.terms) > 1:
        lacking = state.lacking([term.name for term in state.terms])
        fitted_share = {name: 1.0 - state.fit.loss / one.loss for name, one in lacking.items()}
        least = min(fitted_share, key=lambda name: fitted_share[name])
        comparison = state.problem.paired_comparison(lacking[least], state.fit)
        if fitted_share[least] > MIN_GAIN and _term_earns(comparison, lacking[least], level):
            break
        others = tuple(term for term in state.terms if term.name != least)
        state = replace(state.settled(predictor, lacking[least]), terms=others)
    return state


def _leaves_something(problem: Problem, fit: Fit) -> bool:
    return unexplained(problem, fit, residual_dependence(problem, fit)).any


def _without_shifts(predictor: Predictor, given: Model, state: _State) -> _State:
    """Without the effects that a free response in time contains, however well they do beside its coarse steps.

    Beside any other free answer to past commands, without those that earn nothing in a model without terms, the least first: a
    late command and a clock that is early by as much make up for its steps together.
    """
    if any(term.signal == RESPONSE for term in state.terms):
        for name in [shift for shift in SHIFTS if shift in state.names]:
            state = state.without(predictor, name, fit_without(state.problem, state.fit, name))
    while any(term.signal in PAST for term in state.terms) and not {*SHIFTS}.isdisjoint(state.names):
        worth = {name: gain for name, gain in _alone(predictor, given, state).items() if name in SHIFTS}
        least = min(worth, key=lambda name: worth[name])
        if worth[least] > MIN_GAIN * float(state.fit.held_out.mean()):
            break
        state = state.without(predictor, least, fit_without(state.problem, state.fit, least))
    return state


def _restored(predictor: Predictor, state: _State, accepted: Mapping[str, Effect], level: float) -> _State:
    """With the effects that do nearly all that a term does: a curve that can draw an effect leaves nothing for it to earn.

    One effect takes the place of one term, beside the others; then as many of all terms that are left, together. Several effects
    that only together reproduce one curve imitate it.
    """
    lost = {name: effect for name, effect in accepted.items() if name not in state.names}
    for dropped in [*([term] for term in state.terms), list(state.terms)]:
        still_there = [term for term in state.terms if term.name in {one.name for one in dropped}]
        still_lost = {name: effect for name, effect in lost.items() if name not in state.names}
        if still_there and still_lost and len(still_there) == len(dropped):
            state = _exchanged(predictor, state, still_lost, still_there, level)
    return state


def _exchanged(
    predictor: Predictor, state: _State, lost: Mapping[str, Effect], dropped: Sequence[Formula], level: float
) -> _State:
    """With at most as many effects as terms in their place, where these do nearly all that they do (`SPANNED`).

    In likelihood and in metres at every horizon. Then the dropped terms that still earn their place, but for those that can draw
    one of the effects: beside such a curve its number says nothing.
    """
    problem, model = state.problem, state.fit.model
    for term in dropped:
        model = model.without(term.name)
    bare = fit = problem.fit(model)
    names = state.names
    while _share(bare, fit, state.fit) < SPANNED:
        tried = _tried(problem, fit, {n: effect for n, effect in lost.items() if n not in names}, state.known)
        best = min(tried, key=lambda name: float(tried[name].held_out.sum()), default="")
        if len(names) == len(state.names) + len(dropped) or not best:
            return state
        if not _earns(problem.paired_comparison(fit, tried[best]), fit, level) or implausible(tried[best], best):
            return state
        fit, names = tried[best], (*names, best)
    others = tuple(term for term in state.terms if term not in dropped)
    restored = replace(state, names=names, terms=others).settled(predictor, fit)
    if _least_share_m(predictor, restored, restored.problem.fit(model), restored.problem.fit(state.fit.model)) < SPANNED:
        return state
    back = [name for name in names if name not in state.names]
    alone = {name: _worth(restored, name) for name in back}
    for term in dropped:
        again = fitted(restored.problem, restored.fit, term.on, term.term, term.name, term.signal, term.values)
        if again is None or not _term_earns(again.paired_comparison, restored.fit, level):
            continue
        beside = replace(restored.settled(predictor, again.fit), terms=(*restored.terms, again))
        if all(_worth(beside, name) >= KEPT * alone[name] for name in back):
            restored = beside
    return restored


def _least_share_m(predictor: Predictor, effects: _State, bare: Fit, terms: Fit) -> float:
    """As `_share`, of the root mean square error on held-out trials, at the horizon where it is least.

    Only where the terms' error is certainly lower than the effects': over few long windows it differs by luck.
    """
    fits = {"bare": bare, "effects": effects.fit, "terms": terms}
    pose_filter = effects.problem.pose_filter
    errors = paired_errors(predictor, [(name, held_out_steps(predictor, pose_filter, f.model)) for name, f in fits.items()])
    without, by_effects, by_terms = (errors.of(name) for name in fits)
    surely = [h for h, at in errors.horizons.items() if at.change_between("effects", "terms").fell]
    falls = [(without[h].rms_m - by_effects[h].rms_m, without[h].rms_m - by_terms[h].rms_m) for h in surely]
    return min((one / other for one, other in falls if other > 0), default=1.0)


def _worth(state: _State, name: str) -> float:
    """What an effect of a state earns on held-out trials beside all else in it."""
    return paired_elpd_diff(state.lacking([name])[name].held_out, state.fit.held_out)[0]


def _share(bare: Fit, effects: Fit, terms: Fit) -> float:
    """What effects gain on held-out trials, as a share of what terms gain."""
    without = float(bare.held_out.sum())
    return (without - float(effects.held_out.sum())) / max(without - float(terms.held_out.sum()), 1e-9)


def _alone(predictor: Predictor, given: Model, state: _State) -> dict[str, float]:
    """What each effect earns in a model with the effects alone, without terms."""
    if not state.terms or not state.names:
        return {}
    model = state.fit.model
    for term in state.terms:
        model = model.without(term.name)
    problem = problem_for(predictor, model)
    fit = problem.fit(model)
    return {name: paired_elpd_diff(fit_without(problem, fit, name).held_out, fit.held_out)[0] for name in state.names}


def _pruned(predictor: Predictor, state: _State, level: float, alone: Mapping[str, float] | None = None) -> _State:
    """Without the effects that no longer earn their place beside what came in later, the least first.

    ``alone``: what each earns without terms; little beside them is then not enough (`KEPT`).
    """
    while state.names:
        lacking = state.lacking(state.names)
        worth = {name: state.problem.paired_comparison(one, state.fit) for name, one in lacking.items()}
        kept = {n: worth[n].elpd_diff / max(alone[n], 1e-9) if alone else worth[n].elpd_diff for n in state.names}
        least = min(kept, key=lambda name: kept[name])
        # as asked of a term: a model that lacks much may be off by so much in single trials that few are certain
        if _term_earns(worth[least], lacking[least], level) and not (alone and kept[least] < KEPT):
            break
        state = state.without(predictor, least, lacking[least])
    while state.terms and (absurd := next((name for name in state.names if implausible(state.fit, name)), "")):
        # beside a curve no effect needs numbers that no robot has: it bends the curve
        state = state.without(predictor, absurd, fit_without(state.problem, state.fit, absurd))
    return state
