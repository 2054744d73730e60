"""What a verdict cannot say in a word: what to beware of, what is left and where to look, what more trials would settle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from bns.diagnose.beside_terms import presented_fit
from bns.diagnose.data.split_trials import finer
from bns.diagnose.data.tracks import Tracks
from bns.diagnose.data.variables import bare, label, velocity
from bns.diagnose.effect_caveats import (
    implausible_texts,
    on_effects,
    on_heading,
    on_kept,
    on_longer,
    on_moved,
    on_place,
    on_servo_speed,
    on_the_cone,
    whose_error,
)
from bns.diagnose.estimate.cancelling import cancelled
from bns.diagnose.estimate.plausibility import does_no_more
from bns.diagnose.estimate.single_wheel import single_wheel
from bns.diagnose.outcome import Outcome
from bns.diagnose.predict.horizons import IN_WORDS
from bns.diagnose.predict.paired_errors import PairedErrors
from bns.diagnose.residuals.floor_lines import what_to_look_for
from bns.diagnose.residuals.grammar import PAST
from bns.diagnose.residuals.outliers import FAR
from bns.diagnose.residuals.unexplained import Unexplained
from bns.diagnose.select.known_effects import known_effects
from bns.diagnose.select.result import Candidate, SelectionResult
from bns.diagnose.settings import DEFAULTS
from bns.physics.figures import mm, with_unit
from bns.physics.jointed.model import JointedModel

MOST_EFFECTS = DEFAULTS.select.most_effects
LEAST_FALL = DEFAULTS.select.least_fall
NOTABLE = DEFAULTS.verdict.notable
CHANCE = DEFAULTS.residuals.chance
SHOWN = DEFAULTS.report.moments
OFTEN = DEFAULTS.verdict.often


def notes_on(
    found: Outcome,
    tracks: Tracks,
    hint: Candidate | None,
    longer: Sequence[tuple[str, ...]] = (),
    terms: Sequence[str] = (),
    slight: Sequence[str] = (),
    formula_in_words: str = "",
) -> Iterator[str]:
    """All notes, one sentence or two each.

    ``hint``: an effect that more trials might confirm; ``longer``: explanations with one effect more that fit as well;
    ``terms``, ``slight``, ``formula_in_words``: the terms and the formula in words.
    """
    selection = found.selection
    yield from implausible_texts(selection, presented_fit(selection, found.terms, found.errors_with_terms))
    if len(selection.accepted) >= MOST_EFFECTS:
        yield f"The search ends at {MOST_EFFECTS} effects; more may be missing."
    if found.imitating:
        on_floor = isinstance(selection.fit.model, JointedModel)
        what = "a floor that is not alike everywhere" if on_floor else "something that no listed effect explains"
        yield (
            f"{' and '.join(found.imitating)} would lower the error, but only by imitating {what}: with a flexible term for that "
            "in the model, too little gain is left."
        )
    if found.withdrawn:
        yield (
            f"{' with '.join(found.withdrawn)} would raise the likelihood, but not improve predictions of held-out trials "
            "(root mean square and median on the same windows). So it is not presented as an explanation."
        )
    yield from _on_slight(found.unseen, [*slight, *(one.in_words for one in found.slight_along[:1])])
    known = known_effects(selection) if found.negligible else {}
    for name, numbers in found.negligible.items():
        why = ""
        if name not in known or known[name].stage == "clock":
            why = " It may be an artefact of the log, such as rounded time stamps."
        elif known[name].of_measuring:
            why = f" It would be {whose_error(known[name])}."
        said = ", ".join(f"{key} = {number['value']:.3g}{with_unit(number['unit'])}" for key, number in numbers.items())
        yield (
            f"{name} is certain but negligible ({said}): without it no error on held-out trials is higher by {LEAST_FALL:.0%} or "
            f"more, so it is not named.{why}"
        )
    yield from on_moved(found)
    yield from on_kept(found.kept_for)
    yield from on_heading(found.seen_in_heading)
    yield from on_effects(selection, tracks, found.imitating, not (found.rest.any or found.terms))
    yield from single_wheel(found.terms[0].fit if _described(found) else selection.fit)  # the numbers that are shown
    yield from on_servo_speed(selection)
    yield from on_the_cone(selection.fit.model)
    for names in longer:
        yield on_longer(selection, names)
    yield from on_place(found)
    yield from _on_rest(found.rest, tracks)
    formula = found.formula
    if formula is not None and not formula.signal and formula.paired_comparison.p_value < CHANCE:
        values = ", ".join(f"{k} = {v:.4g}" for k, v in formula.values.items())
        said = f"{formula_in_words}: " if formula_in_words else ""
        yield f"A candidate term: {said}{formula.on} + {formula.term} with {values}."
    yield from _on_terms(found, terms, tracks)
    yield from _on_undescribed(found)
    if hint is not None:
        more = int(np.ceil(len(tracks) * max((3.2 / max(hint.paired_comparison.z, 0.5)) ** 2 - 1, 0.5)))
        few = f"{hint.name} may be missing, but {len(tracks)} trials are too few to decide; about {more} more would decide."
        yield few + finer(tracks.duration_s.sum(axis=1))
    yield from _on_odd_numbers(selection)


def _on_odd_numbers(selection: SelectionResult) -> Iterator[str]:
    """On effects that no robot has with such numbers; nothing where an effect is accepted: it explains others' numbers."""
    least = NOTABLE * float(selection.nominal.losses.mean())
    for c in selection.steps[0].ranking if not selection.accepted else ():
        if c.rejected_because and c.paired_comparison.elpd_diff > least and not does_no_more(c.fit, c.name):
            yield (
                f"{c.name} would lower the error, but is no explanation: fitted, {c.rejected_because}. If a measurement of your "
                "own says that this is so, add the effect all the same (bns add)."
            )


def _on_terms(found: Outcome, terms: Sequence[str], tracks: Tracks) -> Iterator[str]:
    """On what no effect explains, in words; or why it is not in the extended model."""
    selection, with_terms = found.selection, found.errors_with_terms
    if with_terms is not None and not with_terms.falls_in_the_end:
        yield from [_on_rejected(terms, with_terms)] if terms else []
        return
    yield from (f"What no listed effect explains behaves like this: {words}." for words in terms)
    if found.terms:
        past = any(term.signal in PAST for term in found.terms)
        yield from (one.in_words for one in cancelled(selection.fit, found.terms[0].fit, selection.accepted, past))
        yield _on_reach(tracks)


def _described(found: Outcome) -> bool:
    """Are there terms, and may they be added?"""
    return bool(found.terms) and (found.errors_with_terms is None or found.errors_with_terms.falls_in_the_end)


def _on_undescribed(found: Outcome) -> Iterator[str]:
    """On effects beside something that no term describes: nothing tells how much of it they stand for."""
    names = found.selection.accepted
    if _described(found) or not names or not found.rest.any:
        return
    known = {h: one for h, one in found.errors.horizons.items() if one.models and one.noise_floor_m > 0}
    at = max(known, key=lambda h: known[h].models[-1].rms_m / known[h].noise_floor_m, default="")
    error, noise = (mm(m, 3) for m in (known[at].models[-1].rms_m, known[at].noise_floor_m)) if at else ("", "")
    sizes = f" (error over {IN_WORDS[at]}: {error}; by noise alone: {noise})" if at else ""
    it, them = ("it", "this effect") if len(names) == 1 else ("they", "these effects")
    yield (
        f"No term describes what is left beside {' and '.join(names)}{sizes}, so {it} may stand for a part of that. The "
        f"intervals hold only if what is left has nothing to do with {them}."
    )


def _on_reach(tracks: Tracks) -> str:
    """Where terms that were fitted hold: a free curve says nothing of commands that were not driven."""
    wheels = tracks.left_m_s, tracks.right_m_s
    low, high = min(float(w.min()) for w in wheels), max(float(w.max()) for w in wheels)
    return (
        f"The free terms describe what this log has driven (wheels from {low:.3g} to {high:.3g} m/s, and turns as quick as "
        "these). Beyond that they are a guess: drive what you will ask of the model, and give it as --more."
    )


def _on_slight(unseen: bool, slight: Sequence[str]) -> Iterator[str]:
    """On what is certainly left and does not count."""
    if unseen:
        described = f" ({'; '.join(slight)})" if slight else ""
        yield (
            f"What is left is certain but slight{described}: at every horizon it adds less to the error than the noise of the "
            "tracker does, so the verdict does not count it."
        )
    elif slight:
        yield (
            f"What is left is certain but slight: {'; '.join(slight)}. A term for it lowers no error on held-out trials by "
            f"{LEAST_FALL:.0%} for certain, so the verdict does not count it."
        )


def _on_rejected(terms: Sequence[str], with_terms: PairedErrors) -> str:
    """On terms that fit, and with which the error on held-out trials rises, or does not fall."""
    risen, of_most = with_terms.rose_in_the_end, with_terms.median_rose_in_the_end
    fallen = [horizon for horizon in with_terms.fell_in_the_end if horizon not in risen]
    by_rms = [horizon for horizon in risen if horizon not in of_most]
    fell = _horizons(fallen)
    what = "a free term fits best that says" if len(terms) == 1 else "free terms fit best that say"
    them = "it" if len(terms) == 1 else "them"
    begun = f"Of what no listed effect explains {what}: {'; '.join(terms)}. With {them} the error on "
    if not risen:
        return f"{begun}held-out trials does not fall where its change is surest, so the extended model does without."
    said = [f"rises over {_horizons(by_rms)}"] if by_rms else []
    if of_most:
        said.append(f"has a higher median over {_horizons(of_most)} (most windows are predicted worse)")
    though = f", though {'it' if by_rms else 'its root mean square'} falls over {fell}" if fell else ""
    return f"{begun}held-out trials {' and '.join(said)}{though}. So something else happens, and the extended model does without."


def _horizons(names: Sequence[str]) -> str:
    return " and ".join(IN_WORDS.get(horizon, horizon) for horizon in names)


def _on_rest(rest: Unexplained, tracks: Tracks) -> Iterator[str]:
    if left := rest.residual_dependence[:SHOWN]:
        along = ", ".join(f"{bare(velocity(p.channel))} along {bare(label(p.variable))} ({p.share:.2%})" for p in left)
        chance = max(p.paired_comparison.p_value for p in left)
        yield (
            "Left unexplained by listed effects, with the fraction of the loss on held-out trials that a free curve along a "
            f"variable removes: {along}; p {'<' if chance < 1e-4 else '<='} {max(chance, 1e-4):.2g}."
        )
    if rest.command_times is not None:
        yield rest.command_times.note
    if rest.autocorrelation is not None:
        yield rest.autocorrelation.in_words
    if rest.lines:
        yield what_to_look_for(rest.lines)
    if rest.outliers:
        worst = "; ".join(o.in_words for o in rest.outliers[:SHOWN])
        more = ", and so on" if len(rest.outliers) > SHOWN else ""
        some = f"{len(rest.outliers)} of {len(tracks)} trials"
        begun = f"{some} have moments with more than {FAR:g} times the usual error ({worst}{more})"
        if rest.shared is not None:
            yield f"{begun}. What they share: {rest.shared.in_words}. Look at what the robot does after such commands."
        elif rest.place is not None:
            yield f"{begun}. What they share: {rest.place.in_words}. {rest.place.to_look_for}"
        elif len(rest.outliers) >= OFTEN * len(tracks):
            yield f"{begun}. That is too often for accidents: look for what they share, such as a place or a change of command."
        else:
            yield (
                f"{begun}. If they share a place, a direction or a change of command, the robot or the floor does this, and it "
                "comes back when that is driven again; else something happened once, such as a push or a cable that caught."
            )
