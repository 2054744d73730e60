"""Effects, numbers and verdicts for somebody who has not read the manual."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from bns.diagnose.design.competing_models import without_last
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.fit import Fit, without_width
from bns.diagnose.report.people import unit_for_people
from bns.diagnose.report.sized import sized_sentence
from bns.diagnose.residuals.drive_scatter import far_above_noise
from bns.diagnose.select.known_effects import known_effects
from bns.diagnose.select.result import SelectionResult
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.values import numbers_of
from bns.physics.figures import decimals

_CAUSES = DEFAULTS.report.causes
_LISTED = DEFAULTS.report.listed_causes
ABOVE_NOISE = "The error is above tracking noise all the same: see the notes."
_UNKNOWN = "something that none of the known effects explains"


def figures_in_words(value: float, low: float | None, high: float | None, unit: str) -> tuple[str, str]:
    """A number with its unit, and its 95 % interval ("" where there is none), rounded to what is known of it."""
    factor, shown = unit_for_people(value, unit)
    ends = () if low is None or high is None or without_width(low, high) else (low, high)
    numbers = [factor * v for v in (value, *ends) if v is not None and np.isfinite(v)]
    if not numbers:
        return "not known", ""
    spread = max(numbers) - min(numbers)
    digits = decimals(spread if spread > 0 else abs(numbers[0]))
    gap = "" if shown.startswith("°") else " "
    ended = f"{gap}{shown}" if shown else ""
    if len(numbers) < 3:
        return f"{numbers[0]:.{digits}f}{ended}", ""
    return f"{numbers[0]:.{digits}f}{ended}", f"{numbers[1]:.{digits}f} to {numbers[2]:.{digits}f}{ended}"


def numbers_in_words(
    fit: Fit, names: tuple[str, ...], numbers: Mapping[str, Mapping[str, Mapping[str, Any]]] | None = None
) -> list[dict[str, str]]:
    """Each number of some effects: effect, what it is, value, interval, and the value as the model file has it.

    ``numbers``: by effect and parameter, in the place of those of the fit.
    """
    texts = {(f.effect, f.parameter.name): f.parameter.text for f in fit.free}
    numbers = numbers_of(fit) if numbers is None else numbers
    return [
        {
            "effect": effect,
            "name": name,
            "text": texts[(effect, name)],
            **dict(
                zip(("value", "interval"), figures_in_words(n["value"], n["low"], n["high"], n["unit"]), strict=True)
            ),
            "exact": f"{n['value']:.6g} {n['unit'] if n['unit'] != '1' else ''}".strip(),
        }
        for effect in names
        for name, n in numbers.get(effect, {}).items()
    ]


def nothing_above_noise(d: Diagnosis) -> bool:
    """Was nothing found, and is the error far above tracking noise all the same?"""
    return d.verdict == "none" and d.errors is not None and far_above_noise(d.errors)


def headline(d: Diagnosis) -> str:
    """The verdict in a few sentences."""
    if nothing_above_noise(d):
        return f"Nothing is missing from the model that these measurements could show. {ABOVE_NOISE}"
    numbers = d.numbers
    said = _all_of(d, d.effects, numbers)
    if d.selection is not None and (d.verdict == "tie" or (d.verdict == "unlisted" and d.selection.competing_models)):
        return " ".join(_alternatives(d, d.selection, numbers))
    return {
        "none": "Nothing is missing from the model that these measurements could show.",
        "effects": f"Missing from the model: {said}.",
        "unlisted": f"Missing from the model: {_joined([*_each_of(d, d.effects, numbers), _UNKNOWN])}."
        if said
        else "Something is missing from the model that none of the known effects explains.",
        "insufficient-data": "These measurements do not suffice to say whether anything is missing.",
    }[d.verdict]


def _alternatives(
    d: Diagnosis, selection: SelectionResult, numbers: Mapping[str, Mapping[str, Mapping[str, Any]]]
) -> Iterator[str]:
    """What all explanations share, what each has beside that, and what none explains."""
    explanations = (selection.accepted, *selection.competing_models)
    shared = tuple(name for name in explanations[0] if all(name in names for names in explanations))
    own = [tuple(name for name in names if name not in shared) for names in explanations]
    causes = [_together(_each_of(d, names, None)) for names in own if names]
    some = causes[:_CAUSES] + (["something else"] if len(causes) > _CAUSES else [])
    if shared:
        yield f"Missing from the model: {_all_of(d, shared, numbers)}."
    also = "also missing" if shared else "missing from the model"
    begun = f"{also.capitalize()}: either" if len(causes) == len(own) else f"Perhaps {also}:"  # one explanation may do without
    yield f"{begun} {'; or '.join(some)}."
    yield f"These measurements cannot decide{' which' if len(causes) > 1 else ''}."
    if d.verdict == "unlisted":
        yield f"And {_UNKNOWN} is missing as well."


def _together(said: Sequence[str]) -> str:
    """Clauses that make one explanation, among others that are set apart by semicolons."""
    return ", and at the same time ".join(said)


def head_of_page(d: Diagnosis) -> tuple[str, list[str]]:
    """The verdict as the title of a page, and what happens as a list below it: empty where the title says it."""
    tied = d.selection is not None and bool(d.selection.competing_models)
    if d.verdict not in {"effects", "unlisted"} or tied or len(d.effects) < _LISTED:
        return headline(d), []
    rest = f" and {_UNKNOWN}" if d.verdict == "unlisted" else ""
    return f"Missing from the model: {len(d.effects)} effects{rest}.", _each_of(d, d.effects, d.numbers)


def with_what(d: Diagnosis) -> str:
    """The extended model, as the beginning of a sentence that follows the headline."""
    if d.verdict == "tie" or (d.selection is not None and d.selection.competing_models):
        return "With the first of these explanations"
    return "With it" if len(d.effects) == 1 else "With them"


def further_notes(d: Diagnosis, formula: bool = False) -> list[str]:
    """The notes, less those that only repeat what is shown at the head of an answer: what is left over.

    ``formula``: is the note wanted that has a formula? Not where the formula is shown as well.
    """
    said = tuple(f"behaves like this: {words}." for words in d.behaviour)
    return [note for note in d.notes if not note.endswith(said) and (formula or not note.startswith("A candidate term: "))]


def _all_of(d: Diagnosis, names: tuple[str, ...], numbers: Mapping[str, Mapping[str, Mapping[str, Any]]] | None = None) -> str:
    """What happens where these effects are at work, in everyday words; how much, where ``numbers`` has it."""
    return _joined(_each_of(d, names, numbers))


def _joined(said: Sequence[str]) -> str:
    """Whole clauses, which have commas and "and" of their own."""
    return "; and ".join(filter(None, ("; ".join(said[:-1]), *said[-1:])))


def _each_of(d: Diagnosis, names: tuple[str, ...], numbers: Mapping[str, Mapping[str, Mapping[str, Any]]] | None) -> list[str]:
    known = known_effects(d.selection) if d.selection else {}
    return [sized_sentence(known[name], (numbers or {}).get(name, {})) for name in names]


def certainty(d: Diagnosis) -> str:
    """How sure the verdict is, in a sentence or two."""
    found = d.selection
    if found is None:
        return d.notes[0] if d.notes else ""
    trials = len(found.problem.predictor.tracks)
    if d.verdict == "none":
        return f"No known effect improves the prediction of held-out trials ({trials} trials)."
    if d.verdict == "insufficient-data":
        return (
            next((n for n in d.notes if "more would" in n), "")
            or f"{trials} trials suggest a missing effect, but are too few to decide."
        )
    if d.verdict == "unlisted":
        left = next((n for n in d.notes if n.startswith(("Left unexplained", "The unexplained motion"))), "")
        with_effects = "as given" if not d.effects else "with this effect" if len(d.effects) == 1 else "with these effects"
        return (
            f"Over {trials} trials, predictions of the model {with_effects} are wrong in a pattern that chance does not explain. "
            f"{left}"
        ).strip()
    chance, tried = next(
        (c.paired_comparison.p_value, len(s.ranking)) for s in found.steps for c in s.ranking if c.name in d.effects
    )
    bound = _rounded_up(min(1.0, tried * chance))
    better = int((found.problem.fit(without_last(found)).held_out > found.fit.held_out).sum())
    return (
        f"{with_what(d)}, {better} of {trials} trials are predicted better, each by a fit to other trials. The probability that "
        f"chance alone gives such a gain to any of the {tried} effects tried is at most {bound:.1g}."
    )


def _rounded_up(bound: float) -> float:
    """To one digit, so that it stays a bound."""
    if bound <= 0:
        return bound
    unit = 10.0 ** math.floor(math.log10(bound))
    return min(1.0, math.ceil(bound / unit - 1e-9) * unit)
