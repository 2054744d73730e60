"""When a finding of the dissertation counts as agreed with, differed from, or undecided yet: intervals decide, not estimates."""

from __future__ import annotations

import math
from dataclasses import dataclass

AGREES, DIFFERS, UNDECIDED = "agrees", "differs", "undecided"
SURE = 0.95


@dataclass(frozen=True)
class Checked:
    """What the dissertation found, what these results say, and which of the three words it comes to."""

    claim: str
    ours: str
    verdict: str
    runs: int | None = None
    """How many runs it is drawn from, where these are not all runs of the task."""


def within(low: float, high: float, lowest: float, highest: float) -> str:
    """Agrees if the interval low..high lies inside lowest..highest, differs if it lies outside, else undecided."""
    if math.isnan(low) or math.isnan(high):
        return UNDECIDED
    if lowest <= low and high <= highest:
        return AGREES
    return DIFFERS if high < lowest or low > highest else UNDECIDED


def near(low: float, high: float, value: float, least: float = 5.0) -> str:
    """The same around a value of the dissertation: within ``least`` or a fifth of it, whichever is more."""
    reach = max(least, 0.2 * abs(value))
    return within(low, high, value - reach, value + reach)


def likely(share: float) -> str:
    """Agrees if it holds in 95 % of the bootstrap samples, differs if in 5 %, else undecided."""
    if math.isnan(share):
        return UNDECIDED
    return AGREES if share >= SURE else DIFFERS if share <= 1 - SURE else UNDECIDED
