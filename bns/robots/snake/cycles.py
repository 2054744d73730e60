"""Controllers of the snake: ten cycles, each with its gait's parameters and how often it is repeated (section 5.3.2)."""

from __future__ import annotations

from typing import Any

import numpy as np

from bns.engine.breeding import couple
from bns.engine.evolution import Population
from bns.engine.jit import exact, fast, inline
from bns.engine.philox import Key, Purpose, philox
from bns.engine.uniform import component_draws, cross, inherited
from bns.robots.snake.rules import (
    BOUNDS,
    LARGEST_AMPLITUDE_RAD,
    LARGEST_RATIO,
    MOST_REPEATS,
    REPEATS,
    TURN_RAD,
    component,
    lift,
    mutate,
)

CYCLES = 10
"""Distinct cycles of a controller."""
COLUMNS = ("a_lat_rad", "a_vert_rad", "omega_rad", "alpha_rad", "repeats")
_COMPONENTS = len(COLUMNS)
_CUTS, _MUTATION, _PROBE = np.uint32(Purpose.CUTS), np.uint32(Purpose.MUTATION), np.uint32(Purpose.PROBE)


def random_cycles(
    key: Key, purpose: Purpose, step: int, n: int, length: int, sorted_amplitudes: bool = False
) -> Population:
    """Uniform in all that is allowed: A_lat in its range, A_vert below it; or the larger of two draws is lateral, if sorted."""
    u = component_draws(key, purpose, step, (n, length, len(COLUMNS)))
    commands = np.empty(u.shape, np.float32)
    amplitudes = np.sort(u[..., :2], axis=-1)[..., ::-1] if sorted_amplitudes else np.cumprod(u[..., :2], axis=-1)
    commands[..., :2] = amplitudes * (LARGEST_AMPLITUDE_RAD, LARGEST_AMPLITUDE_RAD * LARGEST_RATIO)
    commands[..., 2:4] = u[..., 2:4] * TURN_RAD
    commands[..., REPEATS] = 1 + np.floor(u[..., REPEATS] * MOST_REPEATS)
    return Population(np.clip(commands, BOUNDS.low, BOUNDS.high), np.full(n, length, np.int32))


@inline
def breed_pair(commands, order, cdf, share, rate, low, high, span, pair, step, k0, k1, children):  # type: ignore[no-untyped-def]  # compiled
    """Both children of a pair, as far as there is room for them among children (n, cycles, 5); the first child is the elite."""
    a, b = couple(order, cdf, pair, step, k0, k1)
    for child in range(1 + 2 * pair, min(3 + 2 * pair, children.shape[0])):
        for j in range(children.shape[1]):
            command = children[child, j]
            cross(commands[a, j], commands[b, j], share, j, pair, step, k0, k1, command)
            mutate(command, rate, low, high, span, j, child, step, _MUTATION, k0, k1)
        a, b = b, a


@fast
def _draws(slot, individual, purpose, step, k0, k1, words):  # type: ignore[no-untyped-def]  # compiled
    """Five words for each cycle into words (5, n), all at once, so that the generator vectorises: two counters, slot and next."""
    w0, w1, w2, w3, w4 = words[0], words[1], words[2], words[3], words[4]
    for m in range(slot.size):
        draws = philox(slot[m], individual[m], step, purpose, k0, k1)
        w0[m], w1[m], w2[m], w3[m] = draws[0], draws[1], draws[2], draws[3]
    for m in range(slot.size):
        w4[m] = philox(slot[m] + np.uint32(1), individual[m], step, purpose, k0, k1)[0]


@exact
def _words(individuals, cycles, purpose, step, k0, k1):  # type: ignore[no-untyped-def]  # compiled
    """The words (5, individuals * cycles) of all components of all cycles."""
    n = individuals * cycles
    slot, individual, words = np.empty(n, np.uint32), np.empty(n, np.uint32), np.empty((5, n), np.uint32)
    for i in range(individuals):
        for j in range(cycles):
            slot[i * cycles + j], individual[i * cycles + j] = 2 * j, i
    _draws(slot, individual, purpose, step, k0, k1, words)
    return words


@inline
def _same(one: Any, other: Any) -> Any:
    """Whether two cycles are the same but for their repeats: then they do the same."""
    return (one[0] == other[0]) & (one[1] == other[1]) & (one[2] == other[2]) & (one[3] == other[3])


@exact
def _breed_into(commands, order, cdf, share, rate, low, high, span, step, k0, k1, children, origin):  # type: ignore[no-untyped-def]  # compiled
    """As `breed_pair` for all pairs, and where each cycle comes from. The draws of a pair are made once for both children."""
    n, cycles, _ = children.shape
    children[0] = commands[order[0]]
    for j in range(cycles):
        origin[0, j] = order[0] * cycles + j
    crossing, moving = _words(n // 2, cycles, _CUTS, step, k0, k1), _words(n, cycles, _MUTATION, step, k0, k1)
    for pair in range(n // 2):
        a, b = couple(order, cdf, pair, step, k0, k1)
        for child in range(1 + 2 * pair, min(3 + 2 * pair, n)):
            for j in range(cycles):
                front, back, command = commands[a, j], commands[b, j], children[child, j]
                drawn, at = pair * cycles + j, child * cycles + j
                for c in range(_COMPONENTS):
                    value = inherited(front[c], back[c], crossing[c, drawn], share)
                    command[c] = component(value, c, moving[c, at], rate, low[c], high[c], span[c])
                command[1] = lift(command[0], command[1])
                of_back = b * cycles + j if _same(command, back) else -1
                origin[child, j] = a * cycles + j if _same(command, front) else of_back
            a, b = b, a


def breed(
    key: Key,
    parents: np.ndarray,
    order: np.ndarray,
    cdf: np.ndarray,
    share: float,
    rate: float,
    generation: int,
    children: Population,
) -> None:
    """One generation into children, as parents (n, cycles, 5): the best one as it is, uniform crossover with that share of the
    first parent, mutation (table 5.3). ``origin`` names cycles that are the same but for their repeats."""
    bounds = BOUNDS.low, BOUNDS.high, BOUNDS.mutation_span
    _breed_into(parents, order, cdf, share, rate, *bounds, np.uint32(generation), *key.words, children.commands, children.origin)


@exact
def _mutate_all(commands, low, high, span, step, k0, k1):  # type: ignore[no-untyped-def]  # compiled
    for j in range(commands.shape[0]):
        mutate(commands[j], 1.0, low, high, span, j, 0, step, _PROBE, k0, k1)


def perturb(commands: np.ndarray, key: Key, step: int) -> np.ndarray:
    """Cycles (n, 5) with every component moved at random within its mutation span."""
    moved = np.array(commands, np.float32)
    _mutate_all(moved, BOUNDS.low, BOUNDS.high, BOUNDS.mutation_span, np.uint32(step), *key.words)
    return moved


def in_full(controller: np.ndarray) -> np.ndarray:
    """The cycles of one controller (n, 5) in the order in which they are driven, every repeat a row."""
    return np.repeat(controller, controller[:, REPEATS].astype(int), axis=0)
