"""Effects of a search that stand: those with which the held-out error falls, refitted, without those that imitate a floor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from scipy.special import stdtrit

from bns.diagnose.estimate.cross_validation import Judged, judged_errors
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fit_set import fit_set
from bns.diagnose.estimate.plausibility import does_nothing
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.paired_errors import PairedErrors
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.along_variables import ResidualDependence, residual_dependence
from bns.diagnose.residuals.drive_scatter import far_above_noise
from bns.diagnose.residuals.floor_field import imitating_floor
from bns.diagnose.residuals.unexplained import Unexplained, unexplained
from bns.diagnose.select.known_effects import known_effects
from bns.diagnose.select.result import SelectionResult
from bns.diagnose.settings import DEFAULTS
from bns.physics.model import Model

FALSE_ALARM = DEFAULTS.select.false_alarm
ALONE = DEFAULTS.select.body_alone
WITH_EFFECTS = "with the effects"
"""The name of the refitted model in tables of errors."""


@dataclass(frozen=True)
class Standing:
    """Effects of a search, refitted, with the held-out errors of the model as given and with them, and what they leave."""

    selection: SelectionResult
    errors: PairedErrors
    withdrawn: tuple[str, ...]
    """Effects that were accepted and with which the held-out error does not fall; the selection has none then."""
    dependence: list[ResidualDependence]
    rest: Unexplained


def standing_of(
    selection: SelectionResult, predictor: Predictor, given: Model, tick: Callable[[str], None], withdraw: bool = True
) -> Standing:
    """The effects of a selection with which the held-out error falls: all, or those left when the worst were withdrawn."""
    tick("errors on trials held out")
    selection = refitted(selection, predictor, given)
    while uncertain := least_certain(selection):
        selection = refitted(selection.lacking((uncertain,)), predictor, given)
    errors = errors_before_and_after(selection, given)
    searched = selection.accepted
    if withdraw and selection.problem.predictor.luck is not None and not _fell(errors):
        selection, errors = _surer_alone(selection, errors, predictor, given)
    while withdraw and selection.accepted and not errors.falls:
        selection, errors = _without_the_worst(selection, predictor, given)
    withdrawn = tuple(name for name in searched if name not in selection.accepted)
    while withdraw and (neutral := may_be_neutral(selection)):
        selection = refitted(selection.lacking((neutral,)), predictor, given)
        errors = errors_before_and_after(selection, given)
    tick("what is left")
    dependence = residual_dependence(selection.problem, selection.fit)
    rest = unexplained(selection.problem, selection.fit, dependence, far_above_noise(errors))
    return Standing(selection, errors, withdrawn, dependence, rest)


def may_be_neutral(selection: SelectionResult) -> str:
    """The last accepted effect of which no number can be told from neutral once all are fitted together; "" if there is none.

    A few bad moments can earn one a place.
    """
    return next((name for name in reversed(selection.accepted) if does_nothing(selection.fit, name)), "")


def least_certain(selection: SelectionResult) -> str:
    """The accepted effect of a body that is the farthest from certain where the body is simulated itself; "" if all are certain.

    A search reads from curves what an effect gains. They miss the small valleys of the loss, which the last step of a fit knows
    of (`estimate/profiles.py`): there, too, one number at least must be told from neutral at the level that a search asks for.
    """
    fit, step = selection.fit, selection.steps[0] if selection.steps else None
    if selection.problem.predictor.luck is None or step is None:
        return ""
    freedom = max(len(fit.losses) - len(fit.free), 1)
    level = FALSE_ALARM / step.candidates
    needed = float(stdtrit(freedom, 1.0 - level / 2.0) / stdtrit(freedom, 0.975))
    farthest: dict[str, float] = {}
    for name in selection.accepted:
        own = [j for j, number in enumerate(fit.free) if number.effect == name]
        if own and all(j in fit.spans for j in own):
            farthest[name] = max(_intervals_away(fit, j) for j in own)
    least = min(farthest, key=lambda name: farthest[name], default="")
    return least if least and farthest[least] < needed else ""


def _intervals_away(fit: Fit, j: int) -> float:
    """How far a number is from neutral, in halves of its 95 % interval."""
    p, value, (low, high) = fit.free[j].parameter, float(fit.values[j]), fit.spans[j]
    return p.apart(p.neutral, value) / max(p.apart(low, value), p.apart(high, value), 1e-12)


def _fell(errors: PairedErrors) -> bool:
    """Does the error certainly fall at one horizon at least, from the model as given to the last?"""
    return errors.falls and any(at.total is not None and at.total.fell for at in errors.horizons.values())


def _surer_alone(
    selection: SelectionResult, errors: PairedErrors, predictor: Predictor, given: Model
) -> tuple[SelectionResult, PairedErrors]:
    """One effect alone in the place of those of a body with which the error may not fall, if with it the error certainly does.

    A search reads what effects gain from curves, and exchanges what was found first for what gains more on these. Here the best
    that it found alone are simulated.
    """
    first = selection.steps[0].ranking if selection.accepted and selection.steps else ()
    names = [c.name for c in first if not c.rejected_because and (c.name,) != selection.accepted][:ALONE]
    bare = selection.withdrawn() if names else selection
    tried = [refitted(explained_by(bare, (name,)), predictor, given) for name in names]
    judged = [(one, errors_before_and_after(one, given)) for one in tried]
    surer = [pair for pair in judged if _fell(pair[1]) and _relative(pair[1]) < _relative(errors)]
    return min(surer, key=lambda pair: _relative(pair[1]), default=(selection, errors))


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


def beside_the_floor(
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
    other = explained_by(selection.only(kept), others[0]) if others else selection.only(kept)
    return standing_of(other, predictor, given, tick), lost


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
    return judged_errors(predictor, pose_filter, given, with_effects(selection))


def with_effects(selection: SelectionResult) -> list[Judged]:
    """The model with the accepted effects, to be judged; nothing where none was accepted."""
    return [Judged(WITH_EFFECTS, selection.fit.model, selection.problem.pose_filter)] if selection.accepted else []


def explained_by(selection: SelectionResult, names: tuple[str, ...]) -> SelectionResult:
    """The result with other effects, each with numbers near those that the search found for it."""
    known, problem, fit = known_effects(selection), selection.problem, selection.fit
    tried = {c.name: c.fit.model for step in reversed(selection.steps) for c in step.ranking}
    for name in names:
        if name not in selection.accepted:
            fit = fit_with(problem, fit, known[name], tried.get(name))
    return replace(selection, fit=fit, accepted=names, competing_models=())


def with_parts(selection: SelectionResult, names: tuple[str, ...]) -> SelectionResult | None:
    """The result with the simpler effect in the place of each one that extends it and is not among ``names``; None if none does.

    What the longer one has beyond the simpler one may imitate what is left, and the simpler one be there all the same.
    """
    active = {a.effect.name: a for a in selection.fit.model.effects}
    parts = {n: active[n].effect.extends for n in selection.accepted if n not in names and not active[n].replaces}
    parts = {name: part for name, part in parts.items() if part and part not in active}
    if not parts:
        return None
    rest = selection.only(tuple(name for name in selection.accepted if name not in parts))
    return explained_by(rest, tuple(dict.fromkeys(parts.get(name, name) for name in selection.accepted)))
