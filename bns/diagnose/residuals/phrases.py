"""Phrases of which sentences on a term are made: velocities, shares and times in words, and the values that a term has."""

from __future__ import annotations

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.residuals.symbolic import Formula
from bns.physics.formula import value_of

POINTS = 400
"""At which a curve is evaluated to be put in words."""
VELOCITIES = {
    "v": "forward velocity",
    "w": "turning velocity",
    "s": "sideways velocity",
    "east": "velocity east",
    "north": "velocity north",
    "share": "the fraction of the commanded motion that is driven",
    "wheels": "the speed of each wheel",
    "left": "the speed of the left wheel",
    "right": "the speed of the right wheel",
}


def slower(share: float) -> str:
    """A share of a speed that is missing, or that is too much."""
    return f"{'slower' if share >= 0 else 'faster'} by {abs(share):.2%}"


def seconds(time_s: float) -> str:
    """A time (s) in three digits, or more where it is long."""
    return f"{time_s:.3g} s" if abs(time_s) < 100.0 else f"{time_s:.0f} s"


def curve_of(term: Formula, name: str, grid: Array, **others: float) -> Array:
    """The values of a term along one of its variables; ``others``: values of the rest."""
    out: Array = np.broadcast_to(value_of(term.term, {**term.values, name: grid, **others}), grid.shape)
    return out
