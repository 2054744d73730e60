"""What one cycle, path and mutation of the snake come to: the scalar rules of algorithm 3 and table 5.3, for every engine."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from bns.engine.evolution import CommandBounds
from bns.engine.jit import inline
from bns.engine.philox import philox
from bns.engine.uniform import BLOCK_WORDS, blocks_of, moved_by, mutates
from bns.robots.snake.path import PENALTY_M, SMALLEST_SUM_M

MOST_REPEATS = 4
REPEATS = 4
"""Component of a cycle that says how often it is repeated; before it A_lat, A_vert, ω, α."""
_ANGLES = 2
"""The first of two components that go round."""
LARGEST_RATIO = 0.999
"""Largest A_vertical as a share of A_lateral: the dissertation demands less than 1."""
TURN_RAD, LARGEST_AMPLITUDE_RAD, _STEP = 2 * math.pi, math.pi / 2, math.radians(20)
_TURN, _RATIO = np.float32(TURN_RAD), np.float32(LARGEST_RATIO)
BOUNDS = CommandBounds(
    np.array([0, 0, 0, 0, 1], np.float32),
    np.array([LARGEST_AMPLITUDE_RAD, LARGEST_AMPLITUDE_RAD, TURN_RAD, TURN_RAD, MOST_REPEATS], np.float32),
    np.array([_STEP, _STEP, 0.2, 0.2, MOST_REPEATS], np.float32),
)
"""Ranges and largest mutation: 20 degrees of amplitude, 0.2 rad of ω and α; a mutated number of repeats is drawn anew."""
MIDDLE, HALF = (BOUNDS.low + BOUNDS.high) / 2, (BOUNDS.high - BOUNDS.low) / 2
"""Networks see a component as its distance from the middle, in halves of its range."""

NOISE_SD_M = np.array([0.10, 0.05, 0.10, 0.05])
"""Noise in evolution on Δx and Δy of yellow, then of green (section 5.4.1)."""
NOISY_EVALUATIONS = 10
SUBSTITUTE_SD_M = math.sqrt(8) / 100
"""Noise of the substitute world on every displacement: "a variance of 8 cm" (section 5.8), in cm²."""
REACH_M = 2.0
"""Displacements from -1 to 1 m lie between outputs 0 and 1: the order of the largest that cycles make."""
STEP_RAD = 2 * math.sin(math.pi / 12)
"""The longest of a cycle's twelve steps, a radian of its lateral amplitude."""
JOINT_SPEED_RAD_S, SETTLE_S = 2.944, 0.05
"""As in `bns/physics/snake/parameters.yaml`."""


@inline
def normalised(command, middle, half):  # type: ignore[no-untyped-def]  # compiled
    """A_lat, A_vert, ω and α as the networks see them."""
    return (
        (command[0] - middle[0]) / half[0],
        (command[1] - middle[1]) / half[1],
        (command[2] - middle[2]) / half[2],
        (command[3] - middle[3]) / half[3],
    )


@inline
def moved_on(yx, yy, gx, gy, x1, y1, x2, y2, gap):  # type: ignore[no-untyped-def]  # compiled
    """Markers after displacements to the right and along; ``gap`` apart unless that is negative."""
    dx, dy = gx - yx, gy - yy
    scale = 1.0 / math.sqrt(dx * dx + dy * dy)
    ax, ay = dx * scale, dy * scale
    yx, yy = yx + ay * x1 + ax * y1, yy - ax * x1 + ay * y1
    gx, gy = gx + ay * x2 + ax * y2, gy - ax * x2 + ay * y2
    if gap >= 0:
        x, y, dx, dy = (yx + gx) / 2, (yy + gy) / 2, gx - yx, gy - yy
        half = gap / 2 / math.sqrt(dx * dx + dy * dy)
        yx, yy, gx, gy = x - half * dx, y - half * dy, x + half * dx, y + half * dy
    return yx, yy, gx, gy


@inline
def arrived(x, y, unstable, total, goal, goals, half_region, half_x, half_y):  # type: ignore[no-untyped-def]  # compiled
    """Sum of algorithm 3 and goals reached, once a cycle has led to x, y; not to be asked when all are reached."""
    if abs(x) > half_x or abs(y) > half_y:
        total += PENALTY_M
    if abs(x - goals[goal, 0]) <= half_region and abs(y - goals[goal, 1]) <= half_region:
        goal += 1
    if unstable and goal < goals.shape[0]:
        total += PENALTY_M
    return total, goal


@inline
def ended(x, y, total, goal, goals):  # type: ignore[no-untyped-def]  # compiled
    """The sum of a path that ends at x, y with goals left. One that is not finite stays so: what is lost is not found again."""
    if goal < goals.shape[0]:
        total += math.sqrt((x - goals[goal, 0]) ** 2 + (y - goals[goal, 1]) ** 2)
        total += PENALTY_M * (goals.shape[0] - goal - 1)
    return total


@inline
def worth(total: Any) -> Any:
    """Fitness of a sum; what is not a number stays visible."""
    return 1.0 / (SMALLEST_SUM_M if total < SMALLEST_SUM_M else total)


@inline
def component(value: Any, c: Any, word: Any, rate: Any, low: Any, high: Any, span: Any) -> Any:
    """Component c of a command after mutation, with probability ``rate``, within its span; angles go round, else it is cut."""
    if mutates(word, rate):
        if c == REPEATS:
            value = np.float32(1 + math.floor((moved_by(word, rate) + 1) / 2 * MOST_REPEATS))
        else:
            value += np.float32(moved_by(word, rate) * span)
    if _ANGLES <= c < REPEATS:
        value = value + _TURN if value < 0 else value - _TURN if value >= _TURN else value
    return min(max(value, low), high)


@inline
def lift(a_lat: Any, a_vert: Any) -> Any:
    """A_vert of a body that never lifts higher than it bends."""
    return min(a_vert, _RATIO * a_lat)


@inline
def mutate(command, rate, low, high, span, j, individual, step, purpose, k0, k1):  # type: ignore[no-untyped-def]  # compiled
    """Mutate an individual's j-th command (5,) in place (table 5.3)."""
    blocks = blocks_of(command.size)
    for block in range(blocks):
        draws = philox(np.uint32(j * blocks + block), np.uint32(individual), step, purpose, k0, k1)
        for word in range(min(BLOCK_WORDS, command.size - BLOCK_WORDS * block)):
            c = BLOCK_WORDS * block + word
            command[c] = component(command[c], c, draws[word], rate, low[c], high[c], span[c])
    command[1] = lift(command[0], command[1])
