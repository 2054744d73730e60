"""The Khepera III on a GPU: its rollout on networks, and the substitute world with everything that is judged and learnt there."""

from __future__ import annotations

import math

import numpy as np
from numba import cuda

from bns.cuda.on_device.driving import chosen, keep, normals_of
from bns.cuda.on_device.lists import breeding_of_lists
from bns.cuda.on_device.networks import output
from bns.engine.philox import philox
from bns.engine.snn import weight_count
from bns.robots.khepera import ROBOT
from bns.robots.khepera.rules import (
    CENTRE,
    LARGEST_HEADING_RAD,
    PER_UNIT,
    SCALE,
    START,
    aimed,
    at_rest,
    fitness_of,
    normalised,
    step_of,
    unbranched_sine,
)

_WIDTH = weight_count(ROBOT.hidden)
_RADII_M = np.array(ROBOT.radii_m)
_FIRST = np.uint32(0)
_THREADS = 64
"""A thread has a run of its own: few in a block, so that the runs spread over all of the GPU."""

DRIVEN = (
    "fitness_simulation", "fitness_world", "goals_reached", "commands", "driven_ms", "success", "7cm", "10cm", "14cm", "20cm",
)  # fmt: skip
"""What is kept of one controller that was driven, in this order; the last are 1 for success, on the whole and by radius."""
STEPS, DRAWS = 1, 1
bred = breeding_of_lists(ROBOT.bounds)


def driving_grid(runs: int) -> tuple[int, int]:
    """Blocks and threads of `drive`."""
    return -(-runs // _THREADS), min(_THREADS, runs)


@cuda.jit(device=True)
def draw(luck, own, step, thread, threads):  # type: ignore[no-untyped-def]  # compiled
    """Nothing: there is no noise in evolution."""


@cuda.jit(device=True)
def _displaced(w, at, left, right, new_left, new_right, duration):  # type: ignore[no-untyped-def]  # compiled
    """Displacement that three networks from w[at] on foretell: to the right m, ahead m, counter-clockwise rad; float32."""
    return (
        output(w, at, _WIDTH, left, right, new_left, new_right, duration) * SCALE[0],
        output(w, at + _WIDTH, _WIDTH, left, right, new_left, new_right, duration) * SCALE[1],
        output(w, at + 2 * _WIDTH, _WIDTH, left, right, new_left, new_right, duration) * SCALE[2],
    )


@cuda.jit(device=True)
def scored(w, commands, length, goals, own, luck):  # type: ignore[no-untyped-def]  # compiled
    """One controller (longest, 3) on networks w (3 W,): algorithm 2, as `Khepera.score`."""
    x, y, heading, total, goal = START[0], START[1], START[2], 0.0, 0
    left, right = at_rest(CENTRE, PER_UNIT)
    for j in range(length):
        new_left, new_right, duration = normalised(commands[j], CENTRE, PER_UNIT)
        to_right, ahead, turn = _displaced(w, 0, left, right, new_left, new_right, duration)
        left, right = new_left, new_right
        if not abs(heading) <= LARGEST_HEADING_RAD:  # not a number counts as beyond
            total = math.inf
        dx, dy = step_of(to_right, ahead, unbranched_sine(heading), unbranched_sine(heading + math.pi / 2))
        x += dx
        y += dy
        goal, distance = aimed(x, y, goal, goals)
        total += distance
        heading += turn
    return fitness_of(total, goal, goals), goal, length


@cuda.jit(device=True)
def _targets(heading, dx, dy, turn):  # type: ignore[no-untyped-def]  # compiled
    """What the networks should say of a command that was begun with that heading and moved by dx, dy, turn."""
    sine, cosine = math.sin(heading), math.cos(heading)
    return (
        np.float32((dx * sine - dy * cosine) / SCALE[0]),
        np.float32((dx * cosine + dy * sine) / SCALE[1]),
        np.float32(turn / SCALE[2]),
    )


@cuda.jit
def drive(  # type: ignore[no-untyped-def]  # compiled
    evaluation, settings, purpose, learning, static, noise_sd, weights, commands, lengths, order, cdf, goals,
    X, targets, counts, failures, rows,
):  # fmt: skip
    """Drive a controller of each run in the substitute world; a thread a run.

    While ``learning`` it is the winner of the real-world tournament cdf (runs, n), and what it does joins the patterns X
    (2, runs, 5, capacity), targets (2, runs, 3, capacity), counts (2, runs): those to train on first, those to watch second.
    Otherwise it is the fittest. weights (runs, 3 W) are the networks, static (3 W,) and noise_sd (3,) the world; rows (runs,
    evaluations, 10) takes `DRIVEN`.
    """
    run = cuda.grid(1)
    if run >= settings.size or evaluation > settings[run]["evaluations"]:
        return
    own, step = settings[run], np.uint32(evaluation)
    n, aims = own["population"], goals[run, : own["goals"]]
    half = own["generations"] * (evaluation - 1 if learning else evaluation) % 2
    who = chosen(own, learning, order[run, :n], cdf[run, :n], step)
    w = weights[run]
    row = rows[run, evaluation - 1]
    visited = cuda.local.array(4, np.int32)
    for k in range(4):
        visited[k] = 0
    x, y, heading, total, goal = START[0], START[1], START[2], 0.0, 0
    x_snn, y_snn, heading_snn, total_snn, goal_snn = START[0], START[1], START[2], 0.0, 0
    driven_ms = 0.0
    left, right = at_rest(CENTRE, PER_UNIT)
    for j in range(lengths[half, run, who]):
        command = commands[half, run, who, j]
        driven_ms += command[2]
        new_left, new_right, duration = normalised(command, CENTRE, PER_UNIT)
        if abs(heading) > LARGEST_HEADING_RAD:
            total = math.inf
        if abs(heading_snn) > LARGEST_HEADING_RAD:
            total_snn = math.inf

        to_right, ahead, turn = _displaced(static, 0, left, right, new_left, new_right, duration)
        noise = normals_of(philox(np.uint32(j), _FIRST, step, purpose, own["key0"], own["key1"]))
        to_right, ahead = to_right + noise[0] * noise_sd[0], ahead + noise[1] * noise_sd[1]
        turn = turn + noise[2] * noise_sd[2]
        dx, dy = step_of(to_right, ahead, math.sin(heading), math.cos(heading))
        if learning:
            inputs, wanted = (left, right, new_left, new_right, duration), _targets(heading, dx, dy, turn)
            failures[run] += keep(inputs, wanted, 0, j, own, step, run, X, targets, counts)
        x, y, heading = x + dx, y + dy, heading + turn
        goal, distance = aimed(x, y, goal, aims)
        total += distance
        for k in range(4):
            at = min(visited[k], aims.shape[0] - 1)
            visited[k] += visited[k] < aims.shape[0] and math.hypot(x - aims[at, 0], y - aims[at, 1]) <= _RADII_M[k]

        to_right, ahead, turn = _displaced(w, 0, left, right, new_left, new_right, duration)
        dx, dy = step_of(to_right, ahead, math.sin(heading_snn), math.cos(heading_snn))
        x_snn, y_snn, heading_snn = x_snn + dx, y_snn + dy, heading_snn + turn
        goal_snn, distance = aimed(x_snn, y_snn, goal_snn, aims)
        total_snn += distance
        left, right = new_left, new_right
    row[0] = fitness_of(total_snn, goal_snn, aims)
    row[1] = fitness_of(total, goal, aims)
    row[2] = goal
    row[3] = lengths[half, run, who]
    row[4] = driven_ms
    row[5] = visited[0] == aims.shape[0]
    for k in range(4):
        row[6 + k] = visited[k] == aims.shape[0]
