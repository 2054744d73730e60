"""Compiled: algorithm 3 for whole populations, without noise and as the mean over noisy evaluations."""

from __future__ import annotations

import math

import numpy as np

from bns.engine.jit import exact
from bns.robots.snake.path import LEAST_STABLE
from bns.robots.snake.rules import arrived, ended, moved_on, worth


@exact
def _along_path(start, moves, changes, rigid, first, repeats, noise, goals, half_region, half_x, half_y):  # type: ignore[no-untyped-def]  # compiled
    """Sum of algorithm 3, goals reached and distinct cycles used by one controller under one row of noise (steps, 4)."""
    yx, yy, gx, gy = start[0, 0], start[0, 1], start[1, 0], start[1, 1]
    total, goal, step, used = 0.0, 0, 0, 0
    x, y = (yx + gx) / 2, (yy + gy) / 2
    for j in range(repeats.size):
        c, used = first + j, j + 1
        unstable = moves[4, c] < LEAST_STABLE
        if changes.shape[1] > 0:
            gap = changes[4, c] if rigid else -1.0
            yx, yy, gx, gy = moved_on(
                yx, yy, gx, gy, changes[0, c], changes[1, c], changes[2, c], changes[3, c], gap
            )
        for _ in range(int(repeats[j])):
            gap = math.sqrt((gx - yx) ** 2 + (gy - yy) ** 2) if rigid else -1.0
            x1, y1 = moves[0, c] + noise[step, 0], moves[1, c] + noise[step, 1]
            x2, y2 = moves[2, c] + noise[step, 2], moves[3, c] + noise[step, 3]
            yx, yy, gx, gy = moved_on(yx, yy, gx, gy, x1, y1, x2, y2, gap)
            x, y = (yx + gx) / 2, (yy + gy) / 2
            step += 1
            total, goal = arrived(x, y, unstable, total, goal, goals, half_region, half_x, half_y)
            if goal == goals.shape[0]:
                return total, goal, used
    return ended(x, y, total, goal, goals), goal, used


@exact
def evaluate(start, moves, changes, rigid, repeats, noise, goals, half_region, half_x, half_y, fitness, reached, used):  # type: ignore[no-untyped-def]  # compiled
    """Fitness (mean over the rows of noise, if there are any), goals and cycles without noise; how many could not be computed.

    start (2, 2): the markers, m; moves (5, controllers * cycles): displacements m and stability; changes (5, controllers *
    cycles) as of `posture.changes`, or (5, 0) where they are ignored; rigid: the markers cannot drift apart; repeats
    (controllers, cycles); noise (rows, steps, 4) m.
    """
    failures, nothing = 0, np.zeros((noise.shape[1], 4))
    for i in range(repeats.shape[0]):
        first = i * repeats.shape[1]
        total, reached[i], used[i] = _along_path(
            start, moves, changes, rigid, first, repeats[i], nothing, goals, half_region, half_x, half_y
        )
        mean = worth(total)
        if noise.shape[0] > 0:
            mean = 0.0
            for row in range(noise.shape[0]):
                total, _, _ = _along_path(
                    start, moves, changes, rigid, first, repeats[i], noise[row], goals, half_region, half_x, half_y
                )
                mean += worth(total)
            mean /= noise.shape[0]
        fitness[i] = mean
        if not np.isfinite(mean) or not np.isfinite(total):
            fitness[i], reached[i] = 0.0, 0
            failures += 1
    return failures
