"""Compiled: algorithm 3 for whole populations, without noise and as the mean over noisy evaluations."""

from __future__ import annotations

import math

import numpy as np

from bns.engine.jit import exact
from bns.robots.snake.path import PENALTY_M, SMALLEST_SUM_M, START_M

(_YX, _YY), (_GX, _GY) = START_M


@exact
def _moved_on(yx, yy, gx, gy, x1, y1, x2, y2, gap):  # type: ignore[no-untyped-def]  # compiled
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


@exact
def _along_path(moves, changes, rigid, first, repeats, noise, goals, half_region, half_x, half_y):  # type: ignore[no-untyped-def]  # compiled
    """Sum of algorithm 3, goals reached and distinct cycles used by one controller under one row of noise (steps, 4)."""
    yx, yy, gx, gy = _YX, _YY, _GX, _GY
    total, goal, step, used = 0.0, 0, 0, 0
    x, y = (yx + gx) / 2, (yy + gy) / 2
    for j in range(repeats.size):
        c, used = first + j, j + 1
        unstable = moves[4, c] < 0.5
        if changes.shape[1] > 0:
            gap = changes[4, c] if rigid else -1.0
            yx, yy, gx, gy = _moved_on(
                yx, yy, gx, gy, changes[0, c], changes[1, c], changes[2, c], changes[3, c], gap
            )
        for _ in range(int(repeats[j])):
            gap = math.sqrt((gx - yx) ** 2 + (gy - yy) ** 2) if rigid else -1.0
            x1, y1 = moves[0, c] + noise[step, 0], moves[1, c] + noise[step, 1]
            x2, y2 = moves[2, c] + noise[step, 2], moves[3, c] + noise[step, 3]
            yx, yy, gx, gy = _moved_on(yx, yy, gx, gy, x1, y1, x2, y2, gap)
            x, y = (yx + gx) / 2, (yy + gy) / 2
            step += 1
            if abs(x) > half_x or abs(y) > half_y:
                total += PENALTY_M
            if abs(x - goals[goal, 0]) <= half_region and abs(y - goals[goal, 1]) <= half_region:
                goal += 1
                if goal == goals.shape[0]:
                    return total, goal, used
            if unstable:
                total += PENALTY_M
    # From here on a sum that is not finite stays so: a path that was lost cannot be found again.
    total += math.sqrt((x - goals[goal, 0]) ** 2 + (y - goals[goal, 1]) ** 2)
    return total + PENALTY_M * (goals.shape[0] - goal - 1), goal, used


@exact
def evaluate(moves, changes, rigid, repeats, noise, goals, half_region, half_x, half_y, fitness, reached, used):  # type: ignore[no-untyped-def]  # compiled
    """Fitness (mean over the rows of noise, if there are any), goals and cycles without noise; how many could not be computed.

    moves (5, controllers * cycles): displacements m and stability; changes (5, controllers * cycles) as of `posture.changes`, or
    (5, 0) where they are ignored; rigid: the markers cannot drift apart; repeats (controllers, cycles); noise (rows, steps, 4) m.
    """
    failures, nothing = 0, np.zeros((noise.shape[1], 4))
    for i in range(repeats.shape[0]):
        first = i * repeats.shape[1]
        total, reached[i], used[i] = _along_path(
            moves, changes, rigid, first, repeats[i], nothing, goals, half_region, half_x, half_y
        )
        worth = 1.0 / max(total, SMALLEST_SUM_M)
        if noise.shape[0] > 0:
            worth = 0.0
            for row in range(noise.shape[0]):
                total, _, _ = _along_path(
                    moves, changes, rigid, first, repeats[i], noise[row], goals, half_region, half_x, half_y
                )
                worth += 1.0 / max(total, SMALLEST_SUM_M)
            worth /= noise.shape[0]
        fitness[i] = worth
        if not np.isfinite(worth) or not np.isfinite(total):
            fitness[i], reached[i] = 0.0, 0
            failures += 1
    return failures
