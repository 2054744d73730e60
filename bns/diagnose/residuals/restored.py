"""Effects that come back for terms: a curve that can draw an effect leaves nothing for it to earn beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from bns.diagnose.estimate.cross_validation import held_out_steps
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.plausibility import implausible
from bns.diagnose.estimate.significance import paired_elpd_diff
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.paired_errors import paired_errors
from bns.diagnose.residuals.earned_terms import effect_earns, term_earns
from bns.diagnose.residuals.search_state import State, tried_with
from bns.diagnose.residuals.symbolic import Formula, fitted
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect

KEPT = DEFAULTS.residuals.kept_share
SPANNED = DEFAULTS.residuals.spanned_share


def restored(predictor: Predictor, state: State, accepted: Mapping[str, Effect], level: float) -> State:
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
    predictor: Predictor, state: State, lost: Mapping[str, Effect], dropped: Sequence[Formula], level: float
) -> State:
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
        tried = tried_with(problem, fit, {n: effect for n, effect in lost.items() if n not in names}, state.known)
        best = min(tried, key=lambda name: float(tried[name].held_out.sum()), default="")
        if len(names) == len(state.names) + len(dropped) or not best:
            return state
        if not effect_earns(problem.paired_comparison(fit, tried[best]), fit, level) or implausible(tried[best], best):
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
        if again is None or not term_earns(again.paired_comparison, restored.fit, level):
            continue
        beside = replace(restored.settled(predictor, again.fit), terms=(*restored.terms, again))
        if all(_worth(beside, name) >= KEPT * alone[name] for name in back):
            restored = beside
    return restored


def _least_share_m(predictor: Predictor, effects: State, bare: Fit, terms: Fit) -> float:
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


def _worth(state: State, name: str) -> float:
    """What an effect of a state earns on held-out trials beside all else in it."""
    return paired_elpd_diff(state.lacking([name])[name].held_out, state.fit.held_out)[0]


def _share(bare: Fit, effects: Fit, terms: Fit) -> float:
    """What effects gain on held-out trials, as a share of what terms gain."""
    without = float(bare.held_out.sum())
    return (without - float(effects.held_out.sum())) / max(without - float(terms.held_out.sum()), 1e-9)
