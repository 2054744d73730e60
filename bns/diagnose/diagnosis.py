"""The whole diagnosis: from tracks and a model to a verdict that says how sure it is."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from bns.diagnose.caveats import notes_on
from bns.diagnose.data.split_trials import finer
from bns.diagnose.data.tracks import Tracks
from bns.diagnose.estimate.calibration import calibrated, wheel_sizes
from bns.diagnose.estimate.cancelling import cancelled
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.plausibility import fitted_again
from bns.diagnose.estimate.significance import fewest_trials
from bns.diagnose.estimate.smoothing_tracker import LATE
from bns.diagnose.estimate.starts import listed
from bns.diagnose.outcome import alike_in_metres, outcome_of, predicts_better_throughout
from bns.diagnose.parallel import one_thread_each
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.paired_errors import PairedErrors, noise_json, plain
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.along_variables import ResidualDependence
from bns.diagnose.residuals.drive_scatter import scatter_in_words
from bns.diagnose.residuals.earned_terms import curve_does_better
from bns.diagnose.residuals.grammar import PAST
from bns.diagnose.residuals.outliers import one_wheel
from bns.diagnose.residuals.symbolic import Formula
from bns.diagnose.residuals.together import formula_in_words, said_of
from bns.diagnose.residuals.unexplained import NOTHING, Unexplained
from bns.diagnose.residuals.worst_in_words import on_many_apart, on_worst
from bns.diagnose.residuals.worst_trials import WithoutWorst, apart, far_off, most_left_out, standing_out
from bns.diagnose.select.equivalents import TRIED, equivalent_pairs
from bns.diagnose.select.result import Candidate, SelectionResult
from bns.diagnose.select.stepwise import FALSE_ALARM, MIN_GAIN, StepwiseSelection
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.values import before_and_after, dependence_values, numbers_of, numbers_of_term, ranked_values, ties_of
from bns.physics.effect import Effect
from bns.physics.model import ActiveEffect, Model

VERDICTS = ("none", "effects", "tie", "unlisted", "insufficient-data")
FEW_TRIALS = DEFAULTS.verdict.few_trials
_HINT = DEFAULTS.verdict.hint
OFTEN = DEFAULTS.verdict.often


@dataclass(frozen=True)
class Diagnosis:
    """A verdict and everything it rests on. ``selection`` is None where there was too little to search."""

    verdict: str
    selection: SelectionResult | None
    residual_dependence: tuple[ResidualDependence, ...] = ()
    rest: Unexplained = NOTHING
    formula: Formula | None = None
    """The first of the terms; where there are none, a formula that is fitted to the effects and earns something."""
    terms: tuple[Formula, ...] = ()
    """What no effect explains, as terms that can be added one after the other; their fit has the effects and all of them."""
    terms_in_words: tuple[str, ...] = ()
    """One text a term, to stand beside its formula."""
    terms_said: tuple[str, ...] = ()
    """What the terms do (`said_of`): of those that cancel one another, only their sum is said; if empty, as `terms_in_words`."""
    formula_in_words: str = ""
    """Of the formula, where there are no terms."""
    negligible: Mapping[str, dict[str, dict[str, Any]]] = field(default_factory=dict)
    """Effects that are certain but change no error by as much as `least_fall`, with their numbers; not among the accepted."""
    imitating: tuple[str, ...] = ()
    """Effects that a search without the terms accepts, and that earn too little beside them."""
    errors: PairedErrors | None = None
    """Of the model as given and, where effects were accepted, of the model with them: on trials held out."""
    errors_with_terms: PairedErrors | None = None
    """The same, and of the model with effects and terms."""
    notes: tuple[str, ...] = ()
    without_worst: WithoutWorst | None = None
    """Where trials stand out as a whole: what is said with them and without them. What is presented is said without them."""
    calibration: Fit | None = None
    """Of single relative motions: all numbers of robot and sensor fitted together (`calibrated`)."""

    def slim(self) -> Diagnosis:
        """Without the innovations and Jacobians of what was only tried: numbers, intervals and losses of these stay."""
        if self.selection is None:
            return self
        return replace(self, selection=replace(self.selection, steps=tuple(step.slim() for step in self.selection.steps)))

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the accepted effects, in the order in which they were found."""
        return self.selection.accepted if self.selection else ()

    @property
    def model(self) -> Model | None:
        """The model refitted with all accepted effects, without the terms: `errors` are of it.

        Where there are terms its numbers differ from `numbers`, which `model_with_terms` has.
        """
        return self.selection.fit.model if self.selection else None

    @property
    def model_with_terms(self) -> Model | None:
        """The model with the effects and all terms, fitted together: `errors_with_terms` are of it; None without terms."""
        return self.terms[0].fit.model if self.terms else None

    @property
    def terms_rejected(self) -> bool:
        """Does the error on held-out trials not fall with the terms, or certainly rise at a horizon? They are not added then."""
        return _rejected(self.errors_with_terms)

    def as_json(self) -> dict[str, Any]:
        """One object of plain values, as `bns diagnose --json` prints it."""
        selection = self.selection
        return {
            "verdict": self.verdict,
            "effects": list(self.effects),
            "implausible": selection.implausible if selection else {},
            "parameters": self.numbers,
            "negligible": dict(self.negligible),
            "imitating": list(self.imitating),
            "ties": ties_of(selection) if selection else [],
            "explanations": [list(selection.accepted), *map(list, selection.competing_models)] if selection else [],
            "ranking": [ranked_values(c) for c in (selection.steps[0].ranking if selection else ())],
            "error": before_and_after(self.errors) if self.errors else {},
            "tracking_noise": noise_json(self.errors) if self.errors else None,
            "formula": self._formula(),
            "terms": self._terms(),
            "behaviour": list(self.behaviour),
            "error_with_terms": before_and_after(self.errors_with_terms) if self.errors_with_terms else {},
            "residual_dependence": [dependence_values(p) for p in self.residual_dependence],
            "without_worst": self._without_worst(),
            "outliers": [vars(o) for o in self.rest.outliers],
            "command_times": asdict(self.rest.command_times) if self.rest.command_times else None,
            "outliers_share": {**vars(self.rest.shared), "in_words": self.rest.shared.in_words} if self.rest.shared else None,
            "outliers_place": {**vars(self.rest.place), "in_words": self.rest.place.in_words} if self.rest.place else None,
            "notes": list(self.notes),
            "calibration": numbers_of(self.calibration) if self.calibration else {},
            "wheel_sizes": {
                side: {"value": value, "low": low, "high": high}
                for side, (value, low, high) in (wheel_sizes(self.calibration) if self.calibration else {}).items()
            },
        }

    @property
    def behaviour(self) -> tuple[str, ...]:
        """What no effect explains, in clauses: the variable it follows most where no term stands, `moments`, terms that stand."""
        terms = () if self.terms_rejected else self.terms_said or self.terms_in_words
        most = self.rest.residual_dependence[:1] if not terms else ()
        return *(p.in_words for p in most), *self.moments, *terms

    @property
    def moments(self) -> tuple[str, ...]:
        """In clauses: commands at times that scatter or follow something, moments that stand out, and what these share."""
        moments, times = self.rest.outliers, self.rest.command_times
        scattered = (times.in_words,) if times is not None else ()
        if not moments or self.selection is None:
            return scattered
        trials = len(self.selection.problem.predictor.tracks)
        often = "the error is large at some moments, too often for accidents"
        what = often if len(moments) >= OFTEN * trials else "the error is large for a moment"
        worst = f"in {len(moments)} of {trials} trials {what}; the worst is {moments[0].in_words}"
        share = self.rest.shared or self.rest.place
        return tuple(filter(None, (*scattered, worst, one_wheel(moments), share.in_words if share is not None else "")))

    @property
    def numbers(self) -> dict[str, dict[str, dict[str, Any]]]:
        """The numbers of the effects: where terms were found that may be added, as fitted beside these, which keep them unbiased.

        Of single relative motions: as calibrated together, since an effect that was not accepted has a number there, too. Numbers
        that cancel a part of a term are marked ``cancels``; delays beside commands that come at times that differ, ``of_mean``.
        """
        if self.selection is None:
            return {}
        if self.calibration is not None and not self.terms:
            together = numbers_of(self.calibration)
            return {name: together.get(name, values) for name, values in numbers_of(self.selection.fit).items()}
        fit = _presented(self.selection, self.terms, self.errors_with_terms)
        own = {term.name for term in self.terms}
        found = {name: values for name, values in numbers_of(fit).items() if name not in own}
        if fit is not self.selection.fit:
            past = any(term.signal in PAST for term in self.terms)
            for one in cancelled(self.selection.fit, fit, self.selection.accepted, past):
                found[one.name][one.parameter.name]["cancels"] = True
        for name in LATE if self.rest.command_times is not None else ():
            if name in found:
                found[name][LATE[name]]["of_mean"] = True
        return found

    def _without_worst(self) -> dict[str, Any] | None:
        if self.without_worst is None:
            return None
        one = self.without_worst
        said = {"with_them": one.with_them, "without": one.without}
        seen = [{"trial": a.trial, "times": plain(a.times), "share_of_moment": plain(a.share)} for a in one.apart]
        both = {k: {"verdict": v, "effects": list(e)} for k, (v, e) in said.items()}
        return {"trials": list(one.trials), "apart": seen, **both}

    def _terms(self) -> list[dict[str, Any]]:
        return [
            {
                "name": term.name,
                "on": term.on,
                "term": term.term,
                "signal": term.signal,
                "in_words": words,
                "values": {k: plain(v) for k, v in term.values.items()},
                "parameters": numbers_of_term(term),
                "elpd_diff": plain(term.paired_comparison.elpd_diff),
            }
            for term, words in zip(self.terms, self.terms_in_words, strict=True)
        ]

    def _formula(self) -> dict[str, Any] | None:
        if self.formula is None:
            return None
        comparison = self.formula.paired_comparison
        return {
            "on": self.formula.on,
            "term": self.formula.term,
            "in_words": self.formula_in_words,
            "values": {k: plain(v) for k, v in self.formula.values.items()},
            "elpd_diff": plain(comparison.elpd_diff),
            "dse": plain(comparison.dse),
            "p_value": comparison.p_value,
        }


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


def _from_better_numbers(selection: SelectionResult, before: SelectionResult | None) -> SelectionResult:
    """The same effects with numbers near those of another search, where these fit better: places have many valleys."""
    if before is None or set(before.accepted) != set(selection.accepted):
        return selection
    again = selection.problem.fit(before.fit.model)
    return replace(selection, fit=again) if again.loss < selection.fit.loss else selection


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
    if isinstance(predictor, WheelPredictor):
        found = replace(found, selection=alike_in_metres(found.selection))
    left = found.rest.any or bool(found.terms)
    said, slight = said_of(found.terms, predictor), said_of(found.slight, predictor).sentences
    formula = formula_in_words(found.formula, predictor) if not found.terms else ""
    judged = {*found.withdrawn, *found.imitating, *found.negligible}
    hint = _hint(found.selection, len(predictor.tracks), judged, left)
    tick("longer explanations")
    pairs = [] if left else _longer(found.selection, listed(found.selection.nominal.model, extra, predictor.tracks, barred))
    notes = [*notes_on(found, predictor.tracks, hint, pairs, said.sentences, slight, formula)]
    verdict = _verdict(found.selection, left, hint)
    if verdict not in {"unlisted", "insufficient-data"} and isinstance(predictor, WheelPredictor):
        notes += scatter_in_words(predictor, found.selection.problem.pose_filter.noise, found.errors)
    presented = _presented(found.selection, found.terms, found.errors_with_terms)
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


def _rejected(with_terms: PairedErrors | None) -> bool:
    return with_terms is not None and not with_terms.falls_in_the_end


def _presented(selection: SelectionResult, terms: Sequence[Formula], with_terms: PairedErrors | None) -> Fit:
    """The fit whose numbers are shown: with the terms, where there are some that may be added."""
    return terms[0].fit if terms and not _rejected(with_terms) else selection.fit


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
    """The best candidate of a search that accepted nothing, where few trials nearly sufficed; none that was ``judged``.

    None where something is left ``unexplained``: what no effect explains lifts many effects a little.
    """
    if unexplained or selection.accepted or trials >= FEW_TRIALS:
        return None
    step, least = selection.steps[0], MIN_GAIN * float(selection.nominal.losses.mean())
    level = _HINT * FALSE_ALARM / max(step.of, len(step.ranking), 1)
    near = [
        c
        for c in step.ranking
        if not c.rejected_because
        and c.name not in judged
        and c.paired_comparison.p_value < level
        and c.paired_comparison.z > 2
        and c.paired_comparison.elpd_diff > max(step.decoy_threshold, least)
    ]
    return near[0] if near else None
