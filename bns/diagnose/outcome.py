"""What a search ends in: effects that lower the held-out error, terms for what is left, and neither in place of the other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bns.diagnose.beside_terms import (
    beside_those_that_stand,
    does_better_than_more,
    sought_terms,
    standing_beside,
    terms_matter,
    unexplained_beside,
    without_absurd,
)
from bns.diagnose.estimate.cross_validation import Judged, held_out_steps, judged_errors
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.paired_errors import PairedErrors, paired_errors
from bns.diagnose.residuals.along_variables import ResidualDependence, with_curve
from bns.diagnose.residuals.symbolic import Formula, best_formula
from bns.diagnose.residuals.unexplained import NOTHING, Unexplained, without_moments_explained
from bns.diagnose.select.negligible import LEAST_FALL, Shift, fall_matters, negligible_and_errors, seen_in_heading
from bns.diagnose.select.result import SelectionResult
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.standing import (
    Standing,
    beside_the_floor,
    errors_before_and_after,
    explained_by,
    refitted,
    standing_of,
    with_parts,
)
from bns.diagnose.values import numbers_of
from bns.physics.model import Model

SLIGHT = DEFAULTS.residuals.slight_excess


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

    slight_along: tuple[ResidualDependence, ...] = ()
    """Patterns that are certain and do not count: free curves along them lower no error that matters."""

    @property
    def fewer(self) -> bool:
        """Did the search end with more effects than stand?"""
        return bool(self.withdrawn or self.imitating or self.negligible)

    @property
    def slightly_left(self) -> bool:
        """Is something certainly left that does not count?"""
        return bool(self.unseen or self.slight or self.slight_along)

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
    stands = standing_of(searched, predictor, given, tick)
    stands, imitating = beside_the_floor(stands, predictor, given, tick)
    terms: tuple[Formula, ...] = ()
    slight: tuple[Formula, ...] = ()
    with_terms: PairedErrors | None = None
    unseen = stands.rest.any and not stands.rest.outliers and _within_noise(stands.errors)
    response = True if stands.withdrawn else None
    if found := sought_terms(stands.selection, predictor, stands.rest, response):
        if shorter := with_parts(stands.selection, found.names):
            again = sought_terms(shorter, predictor, stands.rest, response)
            if again is not None and set(again.names) - set(found.names):
                stands, found = standing_of(shorter, predictor, given, tick), again
        found = without_absurd(found, stands, predictor, response)
        next_to, lost, new, errors = standing_beside(found, stands, predictor, given, tick)
        if new and errors is not None and not errors.falls:
            again = sought_terms(stands.selection, predictor, stands.rest, response, new)
            if again is not None:
                found = without_absurd(again, stands, predictor, response, new)
                next_to, lost, new, errors = standing_beside(found, stands, predictor, given, tick)
        while set(next_to.withdrawn) & set(found.names):
            found, next_to, more, errors = beside_those_that_stand(next_to, stands.rest, predictor, given, response, tick)
            lost = (*lost, *more)
        unseen = unseen and not does_better_than_more(found, stands.selection, lost)
        matters = errors is None or terms_matter(errors)
        if unseen or (not matters and next_to.rest.any and not unexplained_beside(found, bool(next_to.rest.lines)).any):
            slight = found.terms
        elif matters or next_to.rest.any:
            stands, imitating, terms, with_terms = next_to, lost, found.terms, errors
            if errors is not None and errors.falls_in_the_end:  # what a term describes is no accident
                stands = replace(stands, rest=without_moments_explained(stands.rest, found.problem, found.fit))
    along = () if unseen or slight or terms else _slight_along(stands)
    if unseen or slight or along:
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
        along,
    )


def _slight_along(stands: Standing) -> tuple[ResidualDependence, ...]:
    """All that is left of a body, where it is small patterns alone and free curves along the best lower no error that matters.

    Of wheels the terms tell; few terms are of a body's variables. Contacts that are a little otherwise than in the model leave
    something certain in every long log of it. Small: curves remove less than `least_fall` of the loss. What is larger counts in
    any case, since a curve of velocities may lower no error of something else, such as a spring in a joint.
    """
    rest, problem, fit = stands.rest, stands.selection.problem, stands.selection.fit
    others = rest.outliers or rest.autocorrelation or rest.command_times
    if problem.predictor.luck is None or not rest.residual_dependence or others:
        return ()
    if any(pattern.share >= LEAST_FALL for pattern in rest.residual_dependence):
        return ()
    lacking = Judged("lacking", fit.model, problem.pose_filter)
    for pattern in rest.residual_dependence[:3]:
        found = problem.fit(with_curve(fit.model, problem.predictor, pattern))
        having = Judged("having", found.model, problem.pose_filter)
        errors = judged_errors(problem.predictor, problem.pose_filter, fit.model, (lacking, having))
        if fall_matters(errors, lacking.name, having.name):
            return ()
    return rest.residual_dependence


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
        other = held_out_steps(problem.predictor, problem.pose_filter, explained_by(rest, names).fit.model)
        errors = paired_errors(problem.predictor, [("other", other), ("accepted", accepted)])
        ratios = [at.rms_of("accepted") / at.rms_of("other") for at in errors.horizons.values() if at.windows]
        if not fall_matters(errors, "other", "accepted") or np.log(ratios).mean() > np.log(1.0 - LEAST_FALL):
            alike.append(names)
    return replace(selection, competing_models=tuple(alike))


def _within_noise(errors: PairedErrors) -> bool:
    """Does what is left add less to the held-out error (root sum of squares) than tracking noise does, at every horizon?"""
    pairs = [(at.models[-1].rms_m, at.noise_floor_m) for at in errors.horizons.values()]
    return bool(pairs) and all(rms_m**2 - noise_m**2 < (SLIGHT * noise_m) ** 2 for rms_m, noise_m in pairs)
