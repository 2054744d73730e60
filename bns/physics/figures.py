"""Numbers in sentences: as many figures as say something, no exponent, and their units. All rules on digits are here."""

from __future__ import annotations

import math

import numpy as np

MOST = 12
"""More figures than this are rounding."""
LEAST_OF_INTERVAL = 5
"""So many figures have a number and the ends of its interval at least."""


def figures(value: float, count: int = 2) -> str:
    """So many significant figures, without an exponent: 400, 4.5, 0.031."""
    return str(np.format_float_positional(float(f"{value:.{count - 1}e}"), trim="-"))


def mm(metres: float, count: int = 2) -> str:
    """A length as millimetres."""
    return f"{figures(1e3 * metres, count)} mm"


def figures_apart(low: float, high: float, least: int = 2) -> int:
    """How many significant figures two ends of an interval need to differ; at least so many."""
    return next((count for count in range(least, MOST) if figures(low, count) != figures(high, count)), least)


def figures_of_interval(value: float, low: float, high: float, least: int = LEAST_OF_INTERVAL) -> int:
    """How many significant figures show a number and how far the ends of its interval are apart; at least so many.

    More than `figures_apart`: the ends do not only differ, they show their distance. A place far from the origin has many.
    """
    width = abs(high - low)
    if width == 0.0 or not math.isfinite(width):
        return least
    return max(least, math.ceil(math.log10(max(abs(value), abs(low), abs(high)) / width)) + 1)


def decimals(size: float) -> int:
    """Behind the point, so that two figures of a size are shown; none of nothing."""
    if size == 0.0:
        return 0
    return int(np.clip(1 - np.floor(np.log10(max(size, 1e-12))), 0, 8))


def with_unit(unit: str) -> str:
    """The unit behind a blank; nothing for a bare number."""
    return "" if unit == "1" else f" {unit}"
