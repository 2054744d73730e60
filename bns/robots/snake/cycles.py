"""Controllers of the snake: ten cycles, each with its gait's parameters and how often it is repeated (section 5.3.2)."""

from __future__ import annotations

import math

import numpy as np

from bns.engine.evolution import CommandBounds, Population
from bns.engine.philox import Key, Purpose
from bns.engine.uniform import component_draws, crossover, mutation_moves

CYCLES = 10
"""Distinct cycles of a controller."""
MOST_REPEATS = 4
PARENT_SHARE = 0.5
"""Share of a child's components that come from either parent."""
LARGEST_RATIO = 0.999
"""Largest A_vertical as a share of A_lateral: the source demands less than 1."""
REPEATS = 4

COLUMNS = ("a_lat_rad", "a_vert_rad", "omega_rad", "alpha_rad", "repeats")
_TURN, _AMPLITUDE, _STEP = 2 * math.pi, math.pi / 2, math.radians(20)
BOUNDS = CommandBounds(
    np.array([0, 0, 0, 0, 1], np.float32),
    np.array([_AMPLITUDE, _AMPLITUDE, _TURN, _TURN, MOST_REPEATS], np.float32),
    np.array([_STEP, _STEP, 0.2, 0.2, MOST_REPEATS], np.float32),
)
"""Ranges and largest mutation: 20 degrees of amplitude, 0.2 rad of ω and α; a mutated number of repeats is drawn anew."""


def random_cycles(key: Key, purpose: Purpose, step: int, n: int, length: int) -> Population:
    """Uniform in all that is allowed: of two draws of an amplitude the larger is lateral."""
    u = component_draws(key, purpose, step, (n, length, len(COLUMNS)))
    commands = np.empty(u.shape, np.float32)
    amplitudes = np.sort(u[..., :2], axis=-1)[..., ::-1] * _AMPLITUDE
    commands[..., :2] = amplitudes * (1.0, LARGEST_RATIO)
    commands[..., 2:4] = u[..., 2:4] * _TURN
    commands[..., REPEATS] = 1 + np.floor(u[..., REPEATS] * MOST_REPEATS)
    return Population(np.clip(commands, BOUNDS.low, BOUNDS.high), np.full(n, length, np.int32))


def breed(
    key: Key, parents: Population, order: np.ndarray, cdf: np.ndarray, rate: float, generation: int
) -> np.ndarray:
    """Children (n, cycles, 5) of one generation: the best one unchanged, uniform crossover, mutation (table 5.3)."""
    children = crossover(key, parents.commands, order, cdf, PARENT_SHARE, generation)
    mutates, moves = mutation_moves(key, children.shape, rate, generation)
    return np.concatenate([children[:1], _allowed(_mutated(children, mutates, moves))[1:]])


def _mutated(children: np.ndarray, mutates: np.ndarray, moves: np.ndarray) -> np.ndarray:
    moved = children + (moves * BOUNDS.mutation_span).astype(np.float32)
    moved[..., REPEATS] = 1 + np.floor((moves[..., REPEATS] + 1) / 2 * MOST_REPEATS)
    return np.where(mutates, moved, children)


def _allowed(commands: np.ndarray) -> np.ndarray:
    """Angles are wrapped, everything else is cut at its bounds, and the body never lifts higher than it bends."""
    commands[..., 2:4] = np.mod(commands[..., 2:4], np.float32(_TURN))
    np.clip(commands, BOUNDS.low, BOUNDS.high, out=commands)
    commands[..., 1] = np.minimum(commands[..., 1], np.float32(LARGEST_RATIO) * commands[..., 0])
    return commands


def near(commands: np.ndarray, key: Key, step: int) -> np.ndarray:
    """Cycles (n, 5) with every component moved at random within its mutation span."""
    u = component_draws(key, Purpose.PROBE, step, (1, *commands.shape))[0]
    return _allowed(_mutated(commands, np.ones(commands.shape, bool), 2 * u - 1))


def in_full(controller: np.ndarray) -> np.ndarray:
    """The cycles of one controller (n, 5) in the order in which they are driven, every repeat a row."""
    return np.repeat(controller, controller[:, REPEATS].astype(int), axis=0)
