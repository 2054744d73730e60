"""Uniform crossover and component-wise mutation of lists of one length.

As in `bns.engine.evolution`, ``commands`` is (n, length, components) float32; the draws of each generation come from the key.
Four components share a counter: those of a command take as many as they need.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bns.engine.jit import inline
from bns.engine.philox import Key, Purpose, philox, uniforms

BLOCK_WORDS = 4
_UNIT = 2.0**-32
_CUTS = np.uint32(Purpose.CUTS)


def component_draws(key: Key, purpose: Purpose, step: int, shape: tuple[int, int, int]) -> np.ndarray:
    """Uniform draws (n, length, components), one for every component of every command."""
    n, length, components = shape
    blocks = -(-components // BLOCK_WORDS)
    return uniforms(key, purpose, step, n, blocks * length).reshape(n, length, -1)[..., :components]


@inline
def blocks_of(components: Any) -> Any:
    """Counters that the draws of a command take."""
    return (components + BLOCK_WORDS - 1) // BLOCK_WORDS


@inline
def inherited(front: Any, back: Any, word: Any, share: Any) -> Any:
    """A component of a child: the front parent's with probability ``share``."""
    return front if word * _UNIT < share else back


@inline
def cross(front, back, share, j, pair, step, k0, k1, child):  # type: ignore[no-untyped-def]  # compiled
    """The j-th command (components,) of a pair's child: each component is the front parent's with probability ``share``.

    The same draws with the parents exchanged give the pair's other child (section 5.6: share 0.5).
    """
    blocks = blocks_of(child.size)
    for block in range(blocks):
        draws = philox(np.uint32(j * blocks + block), np.uint32(pair), step, _CUTS, k0, k1)
        for word in range(min(BLOCK_WORDS, child.size - BLOCK_WORDS * block)):
            c = BLOCK_WORDS * block + word
            child[c] = inherited(front[c], back[c], draws[word], share)


@inline
def mutates(word: Any, rate: Any) -> Any:
    """Whether a component with this word mutates."""
    return word * _UNIT < rate


@inline
def moved_by(word: Any, rate: Any) -> Any:
    """Where within its span a component that mutates goes, -1 to 1.

    Given that a draw fell below the rate it is uniform there: it serves twice.
    """
    return 2.0 * (word * _UNIT) / max(rate, 1e-300) - 1.0
