"""Numbers in sentences: as many figures as say something, no exponent, and their units."""

from __future__ import annotations

import numpy as np

MOST = 12
"""More figures than this are rounding."""


def figures(value: float, count: int = 2) -> str:
    """So many significant figures, without an exponent: 400, 4.5, 0.031."""
    return str(np.format_float_positional(float(f"{value:.{count - 1}e}"), trim="-"))


def mm(metres: float, count: int = 2) -> str:
    """A length as millimetres."""
    return f"{figures(1e3 * metres, count)} mm"


def figures_apart(low: float, high: float, least: int = 2) -> int:
    """How many significant figures two ends of an interval need to differ; at least so many."""
    return next((count for count in range(least, MOST) if figures(low, count) != figures(high, count)), least)


def with_unit(unit: str) -> str:
    """The unit behind a blank; nothing for a bare number."""
    return "" if unit == "1" else f" {unit}"
