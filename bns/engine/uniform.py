"""Uniform crossover and component-wise mutation of lists of one length.

As in `bns.engine.evolution`, ``commands`` is (n, length, components) float32; the draws of each generation come from the key.
"""

from __future__ import annotations

import numpy as np

from bns.engine.philox import Key, Purpose, uniforms

BLOCK_WORDS = 4


def component_draws(key: Key, purpose: Purpose, step: int, shape: tuple[int, int, int]) -> np.ndarray:
    """Uniform draws (n, length, components), one for every component of every command."""
    n, length, components = shape
    blocks = -(-components // BLOCK_WORDS)
    return uniforms(key, purpose, step, n, blocks * length).reshape(n, length, -1)[..., :components]


def winners(key: Key, generation: int, order: np.ndarray, cdf: np.ndarray, pairs: int) -> np.ndarray:
    """Two tournament winners a pair, (pairs, 2) indices into the population."""
    draws = uniforms(key, Purpose.PARENTS, generation, pairs, 1)[:, 0, :2]
    places = np.minimum(np.searchsorted(cdf, draws, side="right"), len(order) - 1)
    return np.asarray(order[places])


def crossover(
    key: Key, commands: np.ndarray, order: np.ndarray, cdf: np.ndarray, share: float, generation: int
) -> np.ndarray:
    """Children (n, length, components): the best one, then pairs whose components come from either parent.

    A component of a pair's first child is the first parent's with probability ``share``, its second child's the other
    parent's (section 5.6: 0.5).
    """
    n, length, components = commands.shape
    pairs = n // 2
    parents = winners(key, generation, order, cdf, pairs)
    first, second = commands[parents[:, 0]], commands[parents[:, 1]]
    own = component_draws(key, Purpose.CUTS, generation, (pairs, length, components)) < share
    both = np.stack([np.where(own, first, second), np.where(own, second, first)], axis=1)
    return np.concatenate([commands[order[:1]], both.reshape(-1, length, components)])[:n]


def mutation_moves(key: Key, shape: tuple[int, int, int], rate: float, generation: int) -> tuple[np.ndarray, np.ndarray]:
    """Which components mutate, bool (n, length, components), and where within their span, uniform in [-1, 1).

    The first controller is the elite and does not mutate. Given that a draw fell below the rate it is uniform there: it
    serves twice.
    """
    draws = component_draws(key, Purpose.MUTATION, generation, shape)
    mutates = draws < rate
    mutates[0] = False
    return mutates, np.where(mutates, 2.0 * draws / max(rate, 1e-300) - 1.0, 0.0)
