"""Effects whose numbers act on each other, for searches: what they do is put together from pieces that are simulated once.

A search asks for hundreds of models, and a simulation takes seconds. A curve for each number does not serve where one number does
nothing without the others, as the place of a patch of floor. So such an effect names the pieces of which it is nearly the sum.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from bns.physics.effect import Effect


@dataclass(frozen=True)
class Piece(Effect):
    """A part of an effect: it has one number, and what it does is in proportion to that. No catalogue lists it."""


@dataclass(frozen=True)
class PiecedEffect(Effect):
    """An effect that is nearly the sum of pieces. ``pieces(**values)``: which, and how much of each."""

    pieces: Callable[..., tuple[tuple[Piece, float], ...]] = field(kw_only=True, repr=False)
