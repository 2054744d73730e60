"""Effects beside terms: which of them stand where flexible terms describe what is left, and which of both are believed."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

from bns.diagnose.estimate.cancelling import cancelled
from bns.diagnose.estimate.cross_validation import Judged, judged_errors
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.plausibility import implausible, undetermined
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.paired_errors import PairedErrors
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.along_variables import residual_dependence
from bns.diagnose.residuals.earned_terms import left_over
from bns.diagnose.residuals.established import Established, established
from bns.diagnose.residuals.grammar import PAST, SHIFTS
from bns.diagnose.residuals.symbolic import Formula
from bns.diagnose.residuals.unexplained import Unexplained, unexplained
from bns.diagnose.select.known_effects import known_effects
from bns.diagnose.select.negligible import below_noise, fall_matters, negligible_and_errors
from bns.diagnose.select.result import SelectionResult, certainly_lower
from bns.diagnose.standing import Standing, explained_by, standing_of, with_effects
from bns.physics.model import Model

WITH_TERMS = "and what is left, too"
"""Of the model with the terms that describe what no effect explains, as well."""


def sought_terms(
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


def standing_beside(
    found: Established, stands: Standing, predictor: Predictor, given: Model, tick: Callable[[str], None]
) -> tuple[Standing, tuple[str, ...], tuple[str, ...], PairedErrors | None]:
    """The effects that stand beside terms, those that they left nothing to do, those that they brought to light, and the errors.

    What only the terms brought to light is judged with them, from the model as given: without them it may lower no error.
    """
    selection = stands.selection
    lost = tuple(name for name in selection.accepted if name not in found.names)
    new = tuple(name for name in found.names if name not in selection.accepted)
    chosen = selection.only(tuple(name for name in found.names if name not in new)) if lost else selection
    found_all = explained_by(chosen, found.names) if new else chosen
    next_to = standing_of(found_all, predictor, given, tick, withdraw=not new) if lost or new else stands
    return next_to, lost, new, _errors_with_terms(next_to.selection, given, found) if found.terms else None


def beside_those_that_stand(
    stands: Standing, rest: Unexplained, predictor: Predictor, given: Model, response: bool | None, tick: Callable[[str], None]
) -> tuple[Established, Standing, tuple[str, ...], PairedErrors | None]:
    """The search again beside effects that stand, for terms that were found beside others as well; none where nothing is left.

    With terms that were fitted beside an effect that does not stand, the model would be half of an explanation. No effect comes
    in now: what looks like the one that went would take its place. Returns the terms, the effects that stand beside them, those
    lost, and the errors.
    """
    selection = stands.selection
    known = tuple(known_effects(selection))
    found = sought_terms(selection, predictor, rest, response, known)
    if found is None:
        return Established(selection.accepted, (), selection.problem, selection.fit), stands, (), None
    found = without_absurd(found, replace(stands, rest=rest), predictor, response, known)
    next_to, lost, _, errors = standing_beside(found, stands, predictor, given, tick)
    gone = tuple(name for name in stands.withdrawn if name not in next_to.withdrawn)
    return found, replace(next_to, withdrawn=(*gone, *next_to.withdrawn)), lost, errors


def _errors_with_terms(selection: SelectionResult, given: Model, found: Established) -> PairedErrors:
    """Of the model as given, with the effects, and with the terms in addition, on the same windows."""
    predictor, pose_filter = selection.problem.predictor, selection.problem.pose_filter
    after = [*with_effects(selection), Judged(WITH_TERMS, found.fit.model, found.problem.pose_filter)]
    return judged_errors(predictor, pose_filter, given, after)


def without_absurd(
    found: Established, stands: Standing, predictor: Predictor, response: bool | None, barred: Collection[str] = ()
) -> Established:
    """Without what lowers no error; searched again without effects that are `_absurd`: their terms serve only beside them."""
    selection, gone = stands.selection, set(barred)
    found = _without_negligible(found, selection, predictor)
    while absurd := _absurd(found, selection.fit):
        selection, gone = selection.lacking(absurd), {*gone, *absurd}
        again = sought_terms(selection, predictor, stands.rest, response, gone)
        if again is None:
            break
        found = _without_negligible(again, selection, predictor)
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


def _absurd(found: Established, without: Fit) -> tuple[str, ...]:
    """Effects whose numbers, fitted beside the terms, cannot be believed: they only compensate for a part of a term.

    ``without``: the fit of the effects without terms. A shift in time (`SHIFTS`) whose number an answer to past commands
    multiplies or turns round (`cancelled`) is a part of that answer: nothing tells when such an answer begins from when the
    command comes.
    """
    own = found.names if found.terms else ()
    past = any(term.signal in PAST for term in found.terms)
    parts = [one.name for one in cancelled(without, found.fit, [n for n in own if n in SHIFTS], past)] if past else []
    return tuple(name for name in own if name in parts or implausible(found.fit, name) or undetermined(found.fit, name))


def does_better_than_more(found: Established, selection: SelectionResult, lost: tuple[str, ...]) -> bool:
    """Do terms predict certainly better, at every horizon, than the effects that they leave nothing to do, and that are more?

    Then the effects only together reproduce one curve, however little they leave.
    """
    if not 0 < len(found.terms) < len(lost):
        return False
    return certainly_lower((selection.problem, selection.fit), (found.problem, found.fit), throughout=True)


def terms_rejected(with_terms: PairedErrors | None) -> bool:
    """Does the error on held-out trials not fall with the terms, or certainly rise at a horizon? They are not added then."""
    return with_terms is not None and not with_terms.falls_in_the_end


def presented_fit(selection: SelectionResult, terms: Sequence[Formula], with_terms: PairedErrors | None) -> Fit:
    """The fit whose numbers are shown: with the terms, where there are some that may be added."""
    return terms[0].fit if terms and not terms_rejected(with_terms) else selection.fit


def terms_matter(errors: PairedErrors) -> bool:
    """Do the terms certainly lower the error at one horizon, by as much as is asked of an effect (`least_fall`)?"""
    before = next((at.models[-2].name for at in errors.horizons.values()), "")
    return fall_matters(errors, before, WITH_TERMS)


def unexplained_beside(found: Established, far: bool) -> Unexplained:
    """What neither the effects nor the terms of the search explain; ``far`` as of `unexplained`."""
    return unexplained(found.problem, found.fit, residual_dependence(found.problem, found.fit), far)
