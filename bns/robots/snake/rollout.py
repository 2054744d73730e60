"""Compiled: algorithm 3 for whole populations, without noise and as the mean over noisy evaluations.

All evaluations of a controller go on side by side, each in a lane of its own: roots and quotients of one step wait for those of
the step before, but not for those of another lane. What a lane holds lies in one flat array at distances known to the compiler,
which needs no test then whether they overlap.
"""

from __future__ import annotations

import math

import numpy as np

from bns.engine.jit import MANY_REGISTERS, copy_items, exact, inline
from bns.robots.snake.path import LEAST_STABLE, PENALTY_M
from bns.robots.snake.rules import ended, moved_on, worth

LANES = 16 if MANY_REGISTERS else 12
"""Evaluations side by side: two registers of eight, or three of four. The first is without noise, so that ten rows of noise find
room. Twelve in registers of eight, one of them half full, take nearly twice as long as sixteen."""
_YX, _YY, _GX, _GY, _X, _Y, _AIM_X, _AIM_Y, _TOTAL, _WALKING, _INSIDE = (LANES * k for k in range(11))
_NOISE = LANES * 11
_STATE = LANES * 15


def lanes_of(noise: np.ndarray) -> np.ndarray:
    """Noise (rows, steps, 4), m, of at most `LANES` - 1 rows as the kernel takes it: (steps * 4 * LANES,), the first lane 0."""
    rows, steps, _ = noise.shape
    if rows >= LANES:
        raise ValueError(f"at most {LANES - 1} noisy evaluations go side by side, not {rows}")
    lanes = np.zeros((steps, 4, LANES))
    lanes[:, :, 1 : 1 + rows] = noise.transpose(1, 2, 0)
    return lanes.ravel()


@exact
def _begin(s, start, goals):  # type: ignore[no-untyped-def]  # compiled
    yx, yy, gx, gy = start[0, 0], start[0, 1], start[1, 0], start[1, 1]
    for r in range(LANES):
        s[_YX + r], s[_YY + r], s[_GX + r], s[_GY + r] = yx, yy, gx, gy
        s[_X + r], s[_Y + r] = (yx + gx) / 2, (yy + gy) / 2
        s[_AIM_X + r], s[_AIM_Y + r] = goals[0, 0], goals[0, 1]
        s[_TOTAL + r], s[_WALKING + r] = 0.0, 1.0


@inline
def _on(s, r, x1, y1, x2, y2, gap):  # type: ignore[no-untyped-def]  # compiled
    """Move a lane's markers."""
    s[_YX + r], s[_YY + r], s[_GX + r], s[_GY + r] = moved_on(
        s[_YX + r], s[_YY + r], s[_GX + r], s[_GY + r], x1, y1, x2, y2, gap
    )


@exact
def _change(s, changes, c, rigid):  # type: ignore[no-untyped-def]  # compiled
    """Move every lane's markers by the change into cycle c."""
    for r in range(LANES):
        _on(s, r, changes[0, c], changes[1, c], changes[2, c], changes[3, c], changes[4, c] if rigid else -1.0)


@exact
def _move(s, x1, y1, x2, y2):  # type: ignore[no-untyped-def]  # compiled
    """Move every lane's markers by a cycle and the lane's noise."""
    for r in range(LANES):
        _on(
            s,
            r,
            x1 + s[_NOISE + r],
            y1 + s[_NOISE + LANES + r],
            x2 + s[_NOISE + 2 * LANES + r],
            y2 + s[_NOISE + 3 * LANES + r],
            -1.0,
        )


@exact
def _move_rigid(s, x1, y1, x2, y2):  # type: ignore[no-untyped-def]  # compiled
    """As `_move`, markers as far apart as before."""
    for r in range(LANES):
        dx, dy = s[_GX + r] - s[_YX + r], s[_GY + r] - s[_YY + r]
        gap = math.sqrt(dx**2 + dy**2)
        _on(
            s,
            r,
            x1 + s[_NOISE + r],
            y1 + s[_NOISE + LANES + r],
            x2 + s[_NOISE + 2 * LANES + r],
            y2 + s[_NOISE + 3 * LANES + r],
            gap,
        )


@exact
def _look(s, half_region, half_x, half_y):  # type: ignore[no-untyped-def]  # compiled
    """Which lanes are inside their goal, and whether any is. Positions outside the surface are paid for."""
    for r in range(LANES):
        x, y = (s[_YX + r] + s[_GX + r]) / 2, (s[_YY + r] + s[_GY + r]) / 2
        s[_X + r], s[_Y + r] = x, y
        outside = (abs(x) > half_x) | (abs(y) > half_y)
        s[_TOTAL + r] += PENALTY_M * s[_WALKING + r] if outside else 0.0
        inside = (abs(x - s[_AIM_X + r]) <= half_region) & (abs(y - s[_AIM_Y + r]) <= half_region)
        s[_INSIDE + r] = s[_WALKING + r] if inside else 0.0
    any_inside = 0.0
    for r in range(LANES):
        any_inside += s[_INSIDE + r]
    return any_inside > 0.0


@exact
def _arrive(s, goals, goal, used, cycles):  # type: ignore[no-untyped-def]  # compiled
    """The next goal for lanes that are inside theirs; how many have reached the last one."""
    arrived = 0
    for r in range(LANES):
        if s[_INSIDE + r] > 0:
            goal[r] += 1
            if goal[r] == goals.shape[0]:
                s[_WALKING + r], used[r] = 0.0, cycles
                arrived += 1
            else:
                s[_AIM_X + r], s[_AIM_Y + r] = goals[goal[r], 0], goals[goal[r], 1]
    return arrived


@exact
def _along_paths(  # type: ignore[no-untyped-def]  # compiled
    s, start, moves, changes, rigid, first, repeats, lanes, goals, half_region, half_x, half_y, goal, used
):
    """One controller in every lane: the sums of algorithm 3 in the state s, goals reached and distinct cycles used (LANES,)."""
    goal[:], used[:] = 0, repeats.size
    _begin(s, start, goals)
    step, left = 0, LANES
    for j in range(repeats.size):
        c = first + j
        unstable = moves[4, c] < LEAST_STABLE
        if changes.shape[1] > 0:
            _change(s, changes, c, rigid)
        for _ in range(int(repeats[j])):
            copy_items(s, _NOISE, lanes, 4 * LANES * step, 4 * LANES)
            if rigid:
                _move_rigid(s, moves[0, c], moves[1, c], moves[2, c], moves[3, c])
            else:
                _move(s, moves[0, c], moves[1, c], moves[2, c], moves[3, c])
            if _look(s, half_region, half_x, half_y):
                left -= _arrive(s, goals, goal, used, j + 1)
            if left == 0:
                return
            if unstable:
                for r in range(LANES):
                    s[_TOTAL + r] += PENALTY_M * s[_WALKING + r]
            step += 1
    for r in range(LANES):
        s[_TOTAL + r] = ended(s[_X + r], s[_Y + r], s[_TOTAL + r], goal[r], goals)


@exact
def evaluate(  # type: ignore[no-untyped-def]  # compiled
    start, moves, changes, rigid, repeats, lanes, rows, goals, half_region, half_x, half_y, fitness, reached, used
):
    """Fitness (mean over the rows of noise, if there are any), goals and cycles without noise; how many could not be computed.

    start (2, 2): the markers, m; moves (5, controllers * cycles): displacements m and stability; changes (5, controllers *
    cycles) as of `posture.changes`, or (5, 0) where they are ignored; rigid: the markers cannot drift apart; repeats
    (controllers, cycles); lanes: as of `lanes_of`, of so many rows.
    """
    failures, s, goal, cycles = 0, np.empty(_STATE), np.empty(LANES, np.int64), np.empty(LANES, np.int64)
    for i in range(repeats.shape[0]):
        first = i * repeats.shape[1]
        _along_paths(
            s, start, moves, changes, rigid, first, repeats[i], lanes, goals, half_region, half_x, half_y, goal, cycles
        )
        reached[i], used[i] = goal[0], cycles[0]
        mean, last = worth(s[_TOTAL]), s[_TOTAL + rows]
        if rows > 0:
            mean = 0.0
            for r in range(1, rows + 1):
                mean += worth(s[_TOTAL + r])
            mean /= rows
        fitness[i] = mean
        if not np.isfinite(mean) or not np.isfinite(last):
            fitness[i], reached[i] = 0.0, 0
            failures += 1
    return failures


@exact
def needed(start, moves, changes, rigid, lanes, rows, goals, half_region):  # type: ignore[no-untyped-def]  # compiled
    """The largest number of cycles that any row of noise needs to reach all goals, 0 where none does; without rows, no noise.

    moves and changes (5, cycles) as of `evaluate`, every repeat a cycle of its own.
    """
    s, goal, cycles = np.empty(_STATE), np.empty(LANES, np.int64), np.empty(LANES, np.int64)
    repeats = np.ones(moves.shape[1])
    _along_paths(s, start, moves, changes, rigid, 0, repeats, lanes, goals, half_region, np.inf, np.inf, goal, cycles)
    most = 0
    for r in range(min(1, rows), rows + 1):
        if goal[r] == goals.shape[0]:
            most = max(most, cycles[r])
    return most
