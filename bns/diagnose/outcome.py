"""What a search ends in: effects that lower the held-out error, terms for what is left, and neither in place of the other."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bns.diagnose.estimate.cross_validation import Judged, held_out_steps, judged_errors
from bns.diagnose.estimate.fit_set import fit_set
from bns.diagnose.estimate.plausibility import implausible, undetermined
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.paired_errors import PairedErrors, paired_errors
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.along_variables import ResidualDependence, residual_dependence
from bns.diagnose.residuals.established import Established, established, left_over
from bns.diagnose.residuals.floor_field import imitating_floor
from bns.diagnose.residuals.symbolic import Formula, best_formula
from bns.diagnose.residuals.unexplained import NOTHING, Unexplained, unexplained, without_moments_explained
from bns.diagnose.select.known_effects import known_effects
from bns.diagnose.select.negligible import (
    LEAST_FALL,
    Shift,
    below_noise,
    fall_matters,
    negligible_and_errors,
    seen_in_heading,
)
from bns.diagnose.select.result import SelectionResult, certainly_lower
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.values import numbers_of
from bns.physics.model import Model

SLIGHT = DEFAULTS.residuals.slight_excess
WITH_EFFECTS = "with the effects"
"""The name of the refitted model in tables of errors."""
WITH_TERMS = "and what is left, too"
"""Of the model with the terms that describe what no effect explains, as well."""


@dataclass(frozen=True)
class Standing:
    """Effects of a search, refitted, with the held-out errors of the model as given and with them, and what they leave."""

    selection: SelectionResult
    errors: PairedErrors
    withdrawn: tuple[str, ...]
    """Effects that were accepted and with which the held-out error does not fall; the selection has none then."""
    dependence: list[ResidualDependence]
    rest: Unexplained


@dataclass(frozen=True)
class Outcome:
    """What stands in the end; ``negligible`` and ``imitating``: accepted effects that are not in the selection any more."""

    selection: SelectionResult
    errors: PairedErrors
    dependence: list[ResidualDependence]
    rest: Unexplained
    withdrawn: tuple[str, ...]
    imitating: tuple[str, ...]
    negligible: dict[str, dict[str, dict[str, Any]]]
    beside_negligible: dict[str, dict[str, dict[str, Any]]]
    """The numbers of the effects that stand as they are with the negligible ones in the model; empty if none is."""
    kept_for: dict[str, tuple[Shift, ...]]
    """Effects that no error shows, with the numbers of others that would shift without them."""
    terms: tuple[Formula, ...]
    slight: tuple[Formula, ...]
    """Terms for what is certainly left and does not count, because it is slight."""
    unseen: bool
    """What is left adds less to the errors than the tracker's noise does."""
    errors_with_terms: PairedErrors | None
    formula: Formula | None
    """The first term; without terms, a formula fitted to the variable along which most is left, where it earns something."""
    seen_in_heading: dict[str, tuple[str, float, float]] = field(default_factory=dict)
    """Effects that lower no error of position: at which horizon that of the heading most, without and with them (rad)."""

    @property
    def fewer(self) -> bool:
        """Did the search end with more effects than stand?"""
        return bool(self.withdrawn or self.imitating or self.negligible)

    @property
    def own_clocks(self) -> bool:
        """Has each trial a clock of its own?"""
        return self.selection.fit.model.per_trial_effect is not None


def predicts_better_throughout(one: Outcome, other: Outcome) -> bool:
    """Is the held-out error of one lower at every horizon, each with the terms for what it leaves?

    Asked of clocks that each trial has for itself where something is left beside them: a number that is fitted to each trial
    takes up whatever is peculiar to it, and may stand only if nothing that all trials share does as well. A horizon without
    windows says nothing.
    """
    ours, theirs = (found.errors_with_terms or found.errors for found in (one, other))
    pairs = [(at.models[-1].rms_m, theirs.horizons[h].models[-1].rms_m) for h, at in ours.horizons.items()]
    return not any(a >= b for a, b in pairs)  # NaN where there are no windows: neither


def outcome_of(searched: SelectionResult, predictor: Predictor, given: Model, tick: Callable[[str], None]) -> Outcome:
    """Which of the effects that a search accepted are presented, and with which terms.

    Effects that only imitate what is left give way to its terms, if the terms matter; else the effects stay as they are. Nothing
    counts as left where the errors are at the noise of the tracker, or where terms describe all of it and lower no error that
    matters.
    """
    stands = _standing(searched, predictor, given, tick)
    stands, imitating = _beside_the_floor(stands, predictor, given, tick)
    terms: tuple[Formula, ...] = ()
    slight: tuple[Formula, ...] = ()
    with_terms: PairedErrors | None = None
    unseen = stands.rest.any and not stands.rest.outliers and _within_noise(stands.errors)
    response = True if stands.withdrawn else None
    if found := _established(stands.selection, predictor, stands.rest, response):
        if shorter := _with_parts(stands.selection, found.names):
            again = _established(shorter, predictor, stands.rest, response)
            if again is not None and set(again.names) - set(found.names):
                stands, found = _standing(shorter, predictor, given, tick), again
        found = _believable(found, stands, predictor, response)
        next_to, lost, new, errors = _beside_terms(found, stands, predictor, given, tick)
        if new and errors is not None and not errors.falls:
            again = _established(stands.selection, predictor, stands.rest, response, new)
            if again is not None:
                found = _believable(again, stands, predictor, response, new)
                next_to, lost, new, errors = _beside_terms(found, stands, predictor, given, tick)
        unseen = unseen and not _does_better_than_more(found, stands.selection, lost)
        matters = errors is None or _matters(errors)
        if unseen or (not matters and next_to.rest.any and not _unexplained_beside(found).any):
            slight = found.terms
        elif matters or next_to.rest.any:
            stands, imitating, terms, with_terms = next_to, lost, found.terms, errors
            if errors is not None and errors.falls_in_the_end:  # what a term describes is no accident
                stands = replace(stands, rest=without_moments_explained(stands.rest, found.problem, found.fit))
    if unseen or slight:
        stands = replace(stands, rest=NOTHING)
    whole = stands.selection
    tiny, kept_for, in_heading = ((), {}, {}) if terms else _negligible(whole)
    selection = refitted(whole.lacking(tiny), predictor, given) if tiny else whole
    numbers = numbers_of(whole.fit) if tiny else {}
    # too few trials may show a place for its curve to be certain; it is the best guess where moments stand out
    guesses = stands.rest.residual_dependence or (tuple(stands.dependence[:1]) if stands.rest.outliers else ())
    formula = terms[0] if terms else best_formula(whole.problem, whole.fit, guesses) if guesses else None
    return Outcome(
        selection,
        errors_before_and_after(selection, given) if tiny else stands.errors,
        stands.dependence,
        stands.rest,
        stands.withdrawn,
        imitating,
        {name: numbers[name] for name in numbers if name in tiny},
        {name: numbers[name] for name in numbers if name in selection.accepted},
        kept_for,
        terms,
        slight,
        unseen,
        with_terms,
        formula,
        in_heading,
    )


def _beside_terms(
    found: Established, stands: Standing, predictor: Predictor, given: Model, tick: Callable[[str], None]
) -> tuple[Standing, tuple[str, ...], tuple[str, ...], PairedErrors | None]:
    """The effects that stand beside terms, those that they left nothing to do, those that they brought to light, and the errors.

    What only the terms brought to light is judged with them, from the model as given: without them it may lower no error.
    """
    selection = stands.selection
    lost = tuple(name for name in selection.accepted if name not in found.names)
    new = tuple(name for name in found.names if name not in selection.accepted)
    chosen = selection.only(tuple(name for name in found.names if name not in new)) if lost else selection
    found_all = _explained(chosen, found.names) if new else chosen
    next_to = _standing(found_all, predictor, given, tick, withdraw=not new) if lost or new else stands
    return next_to, lost, new, _errors_with_terms(next_to.selection, given, found) if found.terms else None


def refitted(selection: SelectionResult, predictor: Predictor, given: Model) -> SelectionResult:
    """The result with the numbers that `fit_set` finds for its effects: those that `bns add` gives for the same names."""
    chosen = {a.effect.name: a.effect for a in selection.fit.model.effects}
    if not selection.accepted or selection.fit.model.per_trial_effect is not None:
        return selection
    effects = [chosen[name] for name in selection.accepted]
    problem, fit, _ = fit_set(predictor, given, effects, known=selection.fit.model)
    return replace(selection, problem=problem, nominal=problem.fit(given), fit=fit)


def errors_before_and_after(selection: SelectionResult, given: Model) -> PairedErrors:
    """Of the model as given, and of the accepted one with its numbers fitted to other trials, on the same windows."""
    predictor, pose_filter = selection.problem.predictor, selection.problem.pose_filter
    return judged_errors(predictor, pose_filter, given, _with_effects(selection))


def _standing(
    selection: SelectionResult, predictor: Predictor, given: Model, tick: Callable[[str], None], withdraw: bool = True
) -> Standing:
    """The effects of a selection with which the held-out error falls: all, or those left when the worst were withdrawn."""
    tick("errors on trials held out")
    selection = refitted(selection, predictor, given)
    errors = errors_before_and_after(selection, given)
    searched = selection.accepted
    while withdraw and selection.accepted and not errors.falls:
        selection, errors = _without_the_worst(selection, predictor, given)
    withdrawn = tuple(name for name in searched if name not in selection.accepted)
    tick("what is left")
    dependence = residual_dependence(selection.problem, selection.fit)
    return Standing(selection, errors, withdrawn, dependence, unexplained(selection.problem, selection.fit, dependence))


def _without_the_worst(
    selection: SelectionResult, predictor: Predictor, given: Model
) -> tuple[SelectionResult, PairedErrors]:
    """The selection without the effect whose absence leaves the lowest held-out error, where possible one that lets it fall."""
    if len(selection.accepted) == 1:
        bare = selection.withdrawn()
        return bare, errors_before_and_after(bare, given)
    tried = [refitted(selection.lacking((name,)), predictor, given) for name in selection.accepted]
    judged = [(one, errors_before_and_after(one, given)) for one in tried]
    return min(judged, key=lambda pair: (not pair[1].falls, _relative(pair[1])))


def _relative(errors: PairedErrors) -> float:
    """The errors with the effects over those of the model as given, averaged over the horizons."""
    ratios = [at.models[-1].rms_m / max(at.models[0].rms_m, 1e-12) for at in errors.horizons.values()]
    return sum(ratios) / max(len(ratios), 1)


def _negligible(
    selection: SelectionResult,
) -> tuple[tuple[str, ...], dict[str, tuple[Shift, ...]], dict[str, tuple[str, float, float]]]:
    """As `negligible`, what the others that no error shows are kept for, and those that only the heading's error shows.

    Not asked where trials have clocks of their own.
    """
    if selection.fit.model.per_trial_effect is not None:
        return (), {}, {}
    tiny, errors, kept_for = negligible_and_errors(selection)
    return tiny, kept_for, seen_in_heading(errors, [name for name in selection.accepted if name not in {*tiny, *kept_for}])


def _beside_the_floor(
    stands: Standing, predictor: Predictor, given: Model, tick: Callable[[str], None]
) -> tuple[Standing, tuple[str, ...]]:
    """Where a body leaves something: without effects that only imitate a floor that is not alike everywhere, and their names.

    An explanation of the same quality that has none of them takes the place of the accepted one.
    """
    selection = stands.selection
    if not stands.rest.any or isinstance(predictor, WheelPredictor):
        return stands, ()
    lost = imitating_floor(selection.problem, selection.fit, selection.accepted)
    if not lost:
        return stands, ()
    others = [names for names in selection.competing_models if not set(names) & set(lost)]
    kept = tuple(name for name in selection.accepted if name not in lost)
    other = _explained(selection.only(kept), others[0]) if others else selection.only(kept)
    return _standing(other, predictor, given, tick), lost


def alike_in_metres(selection: SelectionResult) -> SelectionResult:
    """The result without the explanations that fit as well and predict worse: errors add up along a path.

    The accepted one has the certainly lower error on held-out trials at one horizon, by `least_fall`, and is lower by as much on
    average over all (mean of the logarithms).
    """
    if selection.fit.model.per_trial_effect is not None or not selection.competing_models:
        return selection
    problem = selection.problem
    accepted = held_out_steps(problem.predictor, problem.pose_filter, selection.fit.model)
    alike = []
    for names in selection.competing_models:
        rest = selection.only(tuple(name for name in selection.accepted if name in names))
        other = held_out_steps(problem.predictor, problem.pose_filter, _explained(rest, names).fit.model)
        errors = paired_errors(problem.predictor, [("other", other), ("accepted", accepted)])
        ratios = [at.rms_of("accepted") / at.rms_of("other") for at in errors.horizons.values() if at.windows]
        if not fall_matters(errors, "other", "accepted") or np.log(ratios).mean() > np.log(1.0 - LEAST_FALL):
            alike.append(names)
    return replace(selection, competing_models=tuple(alike))


def _explained(selection: SelectionResult, names: tuple[str, ...]) -> SelectionResult:
    """The result with other effects, each with numbers near those that the search found for it."""
    known, problem, fit = known_effects(selection), selection.problem, selection.fit
    tried = {c.name: c.fit.model for step in reversed(selection.steps) for c in step.ranking}
    for name in names:
        if name not in selection.accepted:
            fit = fit_with(problem, fit, known[name], tried.get(name))
    return replace(selection, fit=fit, accepted=names, competing_models=())


def _with_parts(selection: SelectionResult, names: tuple[str, ...]) -> SelectionResult | None:
    """The result with the simpler effect in the place of each one that extends it and is not among ``names``; None if none does.

    What the longer one has beyond the simpler one may imitate what is left, and the simpler one be there all the same.
    """
    active = {a.effect.name: a for a in selection.fit.model.effects}
    parts = {n: active[n].effect.extends for n in selection.accepted if n not in names and not active[n].replaces}
    parts = {name: part for name, part in parts.items() if part and part not in active}
    if not parts:
        return None
    rest = selection.only(tuple(name for name in selection.accepted if name not in parts))
    return _explained(rest, tuple(dict.fromkeys(parts.get(name, name) for name in selection.accepted)))


def _established(
    selection: SelectionResult,
    predictor: Predictor,
    rest: Unexplained,
    response: bool | None = None,
    barred: Collection[str] = (),
) -> Established | None:
    """The search with flexible terms, where anything is left; None where nothing is, or trials have clocks of their own.

    ``response`` as in `established`: where effects were withdrawn, those that stayed are no reason to leave it out. Single
    relative motions are calibrated with all numbers free instead (`calibrated`). ``barred``: not to be brought to light.
    """
    wheeled = isinstance(predictor, WheelPredictor)
    if not wheeled or selection.fit.model.per_trial_effect is not None or predictor.tracks.relative:
        return None
    if not rest.any and not left_over(selection.problem, selection.fit, not selection.accepted):
        return None
    known = known_effects(selection)
    accepted = {name: known[name] for name in selection.accepted}
    past = rest.command_times is None  # a response in time would describe the mean of delays that differ
    tried = [c.name for step in selection.steps[:1] for c in step.ranking if c.name not in accepted]
    others = {name: known[name] for name in tried if name in known and name not in barred}
    found = established(predictor, selection.nominal.model, accepted, response, selection.fit.model, past, others)
    lost = set(selection.accepted) - set(found.names)
    believed = not found.terms or not any(implausible(selection.fit, name) for name in lost)
    if lost and believed and certainly_lower((found.problem, found.fit), (selection.problem, selection.fit)):
        # the effects predict better than what they are said to imitate: it is the terms that imitate; numbers that no robot
        # has are no evidence of that
        return replace(established(predictor, selection.fit.model, {}, False, past=past), names=selection.accepted)
    return found


def _without_negligible(found: Established, selection: SelectionResult, predictor: Predictor) -> Established:
    """Without the effects, and the terms, that lower no held-out error of the model with all of them.

    As it is where there are no terms. Where no term lowers any by itself, all stay: they are judged together later. Terms below
    the noise are marked.
    """
    if not found.terms:
        return found
    own = tuple(term.name for term in found.terms)
    beside = replace(selection, problem=found.problem, fit=found.fit, accepted=(*found.names, *own))
    tiny, errors, _ = negligible_and_errors(beside)
    if set(own) <= set(tiny):
        tiny = tuple(name for name in tiny if name not in own)
    faint = below_noise(errors, own)
    found = replace(found, terms=tuple(replace(term, below_noise=term.name in faint) for term in found.terms))
    if not tiny:
        return found
    model = found.fit.model
    for name in tiny:
        model = model.without(name)
    problem = problem_for(predictor, model, found.problem.pose_filter.noise)
    fit = problem.fit(model)
    names = tuple(name for name in found.names if name not in tiny)
    terms = tuple(replace(term, fit=fit) for term in found.terms if term.name not in tiny)
    return Established(names, terms, problem, fit)


def _does_better_than_more(found: Established, selection: SelectionResult, lost: tuple[str, ...]) -> bool:
    """Do terms predict certainly better, at every horizon, than the effects that they leave nothing to do, and that are more?

    Then the effects only together reproduce one curve, however little they leave.
    """
    if not 0 < len(found.terms) < len(lost):
        return False
    return certainly_lower((selection.problem, selection.fit), (found.problem, found.fit), throughout=True)


def _believable(
    found: Established, stands: Standing, predictor: Predictor, response: bool | None, barred: Collection[str] = ()
) -> Established:
    """Without what lowers no error; searched again without effects that are `_absurd`: their terms serve only beside them."""
    selection = stands.selection
    found = _without_negligible(found, selection, predictor)
    while absurd := _absurd(found):
        selection = selection.lacking(absurd)
        again = _established(selection, predictor, stands.rest, response, barred)
        if again is None:
            break
        found = _without_negligible(again, selection, predictor)
    return found


def _absurd(found: Established) -> tuple[str, ...]:
    """Effects whose numbers, fitted beside the terms, cannot be believed: they only compensate for a part of a term."""
    own = found.names if found.terms else ()
    return tuple(name for name in own if implausible(found.fit, name) or undetermined(found.fit, name))


def _matters(errors: PairedErrors) -> bool:
    """Do the terms certainly lower the error at one horizon, by as much as is asked of an effect (`least_fall`)?"""
    before = next((at.models[-2].name for at in errors.horizons.values()), "")
    return fall_matters(errors, before, WITH_TERMS)


def _within_noise(errors: PairedErrors) -> bool:
    """Does what is left add less to the held-out error (root sum of squares) than tracking noise does, at every horizon?"""
    pairs = [(at.models[-1].rms_m, at.noise_floor_m) for at in errors.horizons.values()]
    return bool(pairs) and all(rms_m**2 - noise_m**2 < (SLIGHT * noise_m) ** 2 for rms_m, noise_m in pairs)


def _unexplained_beside(found: Established) -> Unexplained:
    """What neither the effects nor the terms of the search explain."""
    return unexplained(found.problem, found.fit, residual_dependence(found.problem, found.fit))


def _errors_with_terms(selection: SelectionResult, given: Model, found: Established) -> PairedErrors:
    """Of the model as given, with the effects, and with the terms in addition, on the same windows."""
    predictor, pose_filter = selection.problem.predictor, selection.problem.pose_filter
    after = [*_with_effects(selection), Judged(WITH_TERMS, found.fit.model, found.problem.pose_filter)]
    return judged_errors(predictor, pose_filter, given, after)


def _with_effects(selection: SelectionResult) -> list[Judged]:
    """The model with the accepted effects, to be judged; nothing where none was accepted."""
    return [Judged(WITH_EFFECTS, selection.fit.model, selection.problem.pose_filter)] if selection.accepted else []
