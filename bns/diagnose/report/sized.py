"""An effect's sentence with the numbers that were fitted: "both wheels turn 7 % slower than commanded"."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from string import Formatter
from typing import Any

import numpy as np

from bns.diagnose.report.people import for_people
from bns.diagnose.settings import DEFAULTS
from bns.physics.applied import words_of
from bns.physics.effect import Effect, Parameter

_BY_FACTOR = DEFAULTS.report.by_factor


def sized_sentence(effect: Effect, numbers: Mapping[str, Mapping[str, Any]]) -> str:
    """The effect's `sized` with its numbers; its general sentence where there is none, or where the data leave a side open.

    ``numbers``: those of the effect, by parameter, as `numbers_of` gives them. Of `Effect.sized_by`: where all may be read alone.
    """
    if effect.sized_by is not None:
        each = [numbers.get(p.name, {}) for p in effect.parameters]
        readable = all(n.get("value") is not None and _alone(n) for n in each)
        values = {p.name: float(n["value"]) for p, n in zip(effect.parameters, each, strict=True)} if readable else {}
        return (words_of(effect, values) if values else "") or effect.in_words
    if not effect.sized:
        return effect.in_words
    known = {p.name: p for p in effect.parameters}
    said = []
    for text, name, words, _ in Formatter().parse(effect.sized):
        said.append(text)
        if name is not None:
            sizes = list(_said(known[name], numbers.get(name, {}), words or ""))
            if not sizes:
                return effect.in_words
            said += sizes
    return "".join(said)


def _alone(number: Mapping[str, Any]) -> bool:
    """May the number be read by itself?"""
    return not any(number.get(mark) for mark in ("per_trial", "cancels", "of_mean"))


def _said(p: Parameter, number: Mapping[str, Any], words: str) -> Iterator[str]:
    """A number alone; with ``words`` ("above|below") how far it is from neutral, and to which side; nothing if that is open.

    With a plus before the words the number is said even then: a place has two coordinates, and one of them may be 0.
    """
    value, low, high = (number.get(key) for key in ("value", "low", "high"))
    if value is None or not np.isfinite(value) or not _alone(number):
        return
    within = (high - low) / 2.0 if low is not None and high is not None else np.inf
    if not words:
        yield _size(value, p, within)
        return
    open_side = low is not None and high is not None and low <= p.neutral <= high
    if (value == p.neutral or open_side) and not words.startswith("+"):
        return
    above, below, *only = words.removeprefix("+").split("|")
    if open_side and low is not None and high is not None and np.isfinite(low) and np.isfinite(high):
        yield f"at most {_size(max(p.neutral - low, high - p.neutral), p)} {above} or {below}"
        return
    side = above if value >= p.neutral else below
    if only:
        yield side
    elif p.is_multiple and max(value, 1.0 / value) >= _BY_FACTOR:
        factor = max(value, 1.0 / value)
        yield f"{side} by a factor of {_figures(factor, within * factor / value)}"
    else:
        yield f"{_size(abs(value - p.neutral), p, within)} {side}"


def _size(value: float, p: Parameter, within: float = np.inf) -> str:
    """In units for people; ``within``: half of the interval's width."""
    size, unit = (100.0 * value, "%") if p.unit == "1" else for_people(value, p.unit)
    gap = "" if unit.startswith("°") else " "
    return f"{_figures(size, within * abs(size / value) if value else np.inf)}{gap}{unit}"


def _figures(value: float, within: float = np.inf) -> str:
    """Two significant figures, three of what begins with 1 (124 is not 120 beside an interval), without an exponent.

    More, up to five, where what is rounded off would be more than ``within``: it stands above its interval.
    """
    if value == 0.0 or not np.isfinite(value):
        return f"{value:g}"
    power = int(np.floor(np.log10(abs(value))))
    least = (2 if abs(value) < 2.0 * 10.0**power else 1) - power
    enough = (digits for digits in range(least, 5 - power) if abs(round(value, digits) - value) <= within)
    digits = next(enough, 4 - power)
    return f"{round(value, digits):.{max(digits, 0)}f}".rstrip("0").rstrip(".") if digits > 0 else f"{round(value, digits):.0f}"
