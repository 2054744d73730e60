"""The whole diagnosis: from tracks and a model to a verdict that says how sure it is."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace

import numpy as np

from bns.diagnose.beside_terms import presented_fit
from bns.diagnose.caveats import notes_on
from bns.diagnose.data.split_trials import finer
from bns.diagnose.data.tracks import Tracks
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.calibration import calibrated
from bns.diagnose.estimate.plausibility import fitted_again
from bns.diagnose.estimate.significance import fewest_trials
from bns.diagnose.estimate.starts import listed
from bns.diagnose.outcome import Outcome, alike_in_metres, outcome_of, predicts_better_throughout
from bns.diagnose.parallel import one_thread_each
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.drive_scatter import scatter_in_words, still_left_in_words
from bns.diagnose.residuals.earned_terms import curve_does_better
from bns.diagnose.residuals.together import formula_in_words, said_of
from bns.diagnose.residuals.worst_in_words import on_many_apart, on_worst
from bns.diagnose.residuals.worst_trials import WithoutWorst, apart, far_off, most_left_out, standing_out
from bns.diagnose.select.equivalents import TRIED, equivalent_pairs, more_numbers
from bns.diagnose.select.result import Candidate, SelectionResult
from bns.diagnose.select.stepwise import FALSE_ALARM, MIN_GAIN, StepwiseSelection, least_z
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect
from bns.physics.model import ActiveEffect, Model

FEW_TRIALS = DEFAULTS.verdict.few_trials
_HINT = DEFAULTS.verdict.hint


@one_thread_each()
def diagnose(
    predictor: Predictor,
    model: Model,
    *,
    extra: Mapping[str, Effect] | None = None,
    tick: Callable[[str], None] = lambda _: None,
    barred: Collection[str] = (),
    alone: Callable[[Candidate], None] = lambda _: None,
) -> Diagnosis:
    """What the model lacks on these tracks, effects named in ``barred`` aside.

    ``alone`` is told what an effect earns by itself as soon as that is known, by several threads; a later search may correct it.

    Where the held-out error does not fall with all effects, the worst are withdrawn until it does. A few trials that are unlike
    the rest count nothing in the fits of a second search, whose end is presented; errors are always those of all trials. Where
    others stand out beside them, so that they are more than a few, all count.
    """
    found = _diagnosed(predictor, model, extra, tick, barred, alone)
    if found.selection is None or not isinstance(predictor, WheelPredictor) or predictor.tracks.relative:
        return found
    wild = standing_out(found.selection.problem, found.selection.fit)
    if not len(wild):
        return found
    without = _diagnosed(predictor.not_counting(wild.tolist()), model, extra, tick, barred, alone, found.selection)
    if without.selection is not None:
        hidden = far_off(without.selection.problem, without.selection.fit)
        if len(hidden) and len(wild) + len(hidden) > most_left_out(len(predictor.tracks)):
            every = [predictor.tracks.names[i] for i in (*wild, *hidden)]
            return replace(found, notes=(on_many_apart(every), *found.notes))
    names = tuple(predictor.tracks.names[i] for i in wild)
    seen = tuple(apart(found.selection.problem, found.selection.fit, wild.tolist()))
    both = WithoutWorst(names, (found.verdict, found.effects), (without.verdict, without.effects), seen)
    return replace(without, without_worst=both, notes=(on_worst(both), *without.notes))


def _diagnosed(
    predictor: Predictor,
    model: Model,
    extra: Mapping[str, Effect] | None,
    tick: Callable[[str], None],
    barred: Collection[str],
    alone: Callable[[Candidate], None],
    before: SelectionResult | None = None,
) -> Diagnosis:
    """One search, and what it leaves; ``before``: a search on nearly the same, whose end or numbers may serve here too."""
    search = StepwiseSelection(predictor, model, extra, tick, barred, alone, curve_does_better=curve_does_better)
    reason = too_little(predictor.tracks, fewest_trials(search.level))
    if reason:
        return Diagnosis("insufficient-data", None, notes=(reason,))
    found = outcome_of(_from_better_numbers(search.run(before), before), predictor, model, tick)
    if found.own_clocks and model.per_trial_effect is None and found.rest.any:
        shared = StepwiseSelection(
            predictor, model, extra, tick, barred, own_clocks=False, curve_does_better=curve_does_better, begun=search
        )
        without = outcome_of(_from_better_numbers(shared.run(), before), predictor, model, tick)
        found = found if predicts_better_throughout(found, without) else without
    if found.fewer and isinstance(predictor, WheelPredictor):  # of a body it would take minutes
        found = replace(found, selection=search.competing(found.selection, alike=bool(found.terms)))
    left = found.rest.any or bool(found.terms)
    tick("longer explanations")
    pairs = [] if left else _longer(found.selection, listed(found.selection.nominal.model, extra, predictor.tracks, barred))
    as_short = [names for names in pairs if more_numbers(found.selection, names) <= 0]
    if as_short:
        competing = (*found.selection.competing_models, *as_short)
        found = replace(found, selection=replace(found.selection, competing_models=competing))
    if isinstance(predictor, WheelPredictor):
        found = replace(found, selection=alike_in_metres(found.selection))
    said, slight = said_of(found.terms, predictor), said_of(found.slight, predictor).sentences
    formula = formula_in_words(found.formula, predictor) if not found.terms else ""
    judged = {*found.withdrawn, *found.imitating, *found.negligible}
    hint = _hint(found.selection, len(predictor.tracks), judged, left or found.slightly_left)
    longer = [names for names in pairs if names not in as_short]
    notes = [*notes_on(found, predictor.tracks, hint, longer, said.sentences, slight, formula)]
    verdict = _verdict(found.selection, left, hint)
    if isinstance(predictor, WheelPredictor):
        notes += _on_what_remains(found, predictor, verdict)
    presented = presented_fit(found.selection, found.terms, found.errors_with_terms)
    contradicted = fitted_again(model, presented, contradicted=True) if found.terms or found.selection.accepted else ()
    return Diagnosis(
        verdict=verdict,
        selection=found.selection,
        residual_dependence=tuple(found.dependence[:12]),
        rest=found.rest,
        formula=found.formula,
        terms=found.terms,
        terms_in_words=said.of_each,
        terms_said=said.sentences,
        formula_in_words=formula,
        negligible=found.negligible,
        imitating=found.imitating,
        errors=found.errors,
        errors_with_terms=found.errors_with_terms,
        notes=(*notes, *(f"{said} The interval does not contain the number that was given." for said in contradicted)),
        calibration=calibrated(predictor, model, barred),
    )


def _on_what_remains(found: Outcome, predictor: WheelPredictor, verdict: str) -> list[str]:
    """Where the error is far above noise after all: the drive's scatter, or what terms leave of what no effect explains."""
    say, errors = (still_left_in_words, found.errors_with_terms) if verdict == "unlisted" else (scatter_in_words, found.errors)
    if verdict == "insufficient-data" or errors is None or (verdict == "unlisted" and not errors.falls_in_the_end):
        return []
    return say(predictor, found.selection.problem.pose_filter.noise, errors)


def _from_better_numbers(selection: SelectionResult, before: SelectionResult | None) -> SelectionResult:
    """The same effects with numbers near those of another search, where these fit better: places have many valleys."""
    if before is None or set(before.accepted) != set(selection.accepted):
        return selection
    again = selection.problem.fit(before.fit.model)
    return replace(selection, fit=again) if again.loss < selection.fit.loss else selection


def _longer(selection: SelectionResult, effects: Mapping[str, Effect]) -> list[tuple[str, ...]]:
    """Pairs of effects that explain what one accepted effect explains; of those that the search tried."""
    tried = {c.name for step in selection.steps for c in step.ranking}
    others = [effect for name, effect in effects.items() if name in tried and name not in selection.accepted]
    by_name = {effect.name: effect for effect in others}
    nearly = {name: _nearly(selection, name, by_name) for name in selection.accepted}
    return equivalent_pairs(selection.problem, selection.fit, selection.accepted, others, nearly)


def _nearly(selection: SelectionResult, name: str, others: Mapping[str, Effect]) -> list[ActiveEffect]:
    """The best of the effects that an accepted one, or what it extends, was chosen from, each with its numbers then."""
    if selection.problem.predictor.screening is not None:  # a fit takes too long
        return []
    extends = next(a.effect.extends for a in selection.fit.model.effects if a.effect.name == name)
    came = next((step for step in selection.steps if step.selected in {name, extends}), None)
    ranked = [c for c in (came.ranking if came else ()) if c.name in others and not c.rejected_because][:TRIED]
    return [ActiveEffect(others[c.name], tuple(c.fit.model.values_of(c.name).values())) for c in ranked]


def too_little(tracks: Tracks, fewest: int) -> str:
    """Why nothing can be concluded from these tracks, of which there must be so many; "" if something may."""
    if len(tracks) < fewest:
        return (
            f"{len(tracks)} trial{'' if len(tracks) == 1 else 's'}: anything they show could be due to chance. At least {fewest} "
            f"trials are needed; 20 or more reveal large effects, 60 small ones.{finer(tracks.duration_s.sum(axis=1))}"
        )
    frames = np.diff(tracks.first)
    if np.median(frames) < 2:
        return (
            "Most trials have only one tracked pose; a displacement needs two: log the pose before and after commands."
        )
    on_wheels = tracks.duration_s.shape[1] > 0
    if on_wheels and not ((np.abs(tracks.left_m_s) + np.abs(tracks.right_m_s)) * tracks.duration_s).any():
        return "The robot was never commanded to move; drive it with commands of different speeds."
    ends = [tracks.pose[a:b, :2] for a, b in zip(tracks.first[:-1], tracks.first[1:], strict=True)]
    if max(float(np.ptp(p, axis=0).max()) for p in ends if len(p)) < 5e-3:
        return "The robot never moved by more than 5 mm, whatever the command: is it tracked, and are its motors on?"
    return ""


def _verdict(selection: SelectionResult, unexplained: bool, hint: Candidate | None) -> str:
    if unexplained:
        return "unlisted"
    if selection.competing_models:
        return "tie"
    if selection.accepted:
        return "effects"
    return "insufficient-data" if hint else "none"


def _hint(
    selection: SelectionResult, trials: int, judged: Collection[str] = (), unexplained: bool = False
) -> Candidate | None:
    """The best candidate of a search that ends in nothing, where few trials nearly sufficed; none that was ``judged``.

    Of its last round, beside what it accepted and was judged then: without that, others imitate it. Nor one that was certain
    enough to be taken: another stood for it and was judged, as a late clock stands for a late command. None where something is
    left ``unexplained``, however slight: what no effect explains lifts many effects a little.
    """
    if unexplained or selection.accepted or trials >= FEW_TRIALS:
        return None
    step, least = selection.steps[-1], MIN_GAIN * float(selection.nominal.losses.mean())
    level = _HINT * FALSE_ALARM / step.candidates
    enough = least_z(selection.problem.predictor)
    near = [
        c
        for c in step.ranking
        if not c.rejected_because
        and c.name not in judged
        and c.paired_comparison.p_value < level
        and c.paired_comparison.z > 2
        and not (c.paired_comparison.p_value < FALSE_ALARM / step.candidates and c.paired_comparison.z > enough)
        and c.paired_comparison.elpd_diff > max(step.decoy_threshold, least)
    ]
    return near[0] if near else None
