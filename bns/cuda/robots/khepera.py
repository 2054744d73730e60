"""The Khepera III on a GPU: its rollout on networks, and the substitute world with everything that is judged and learnt there."""

from __future__ import annotations

import math

import numpy as np
from numba import cuda

from bns.cuda.networks import output
from bns.engine.breeding import winner
from bns.engine.patterns import TRAINING_SHARE
from bns.engine.philox import Purpose, philox
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
_PICK, _SPLIT = np.uint32(Purpose.PICK), np.uint32(Purpose.SPLIT)
_FIRST = np.uint32(0)
_UNIT = 2.0**-32

DRIVEN = ("fitness_simulation", "fitness_world", "goals_reached", "commands", "driven_ms", "7cm", "10cm", "14cm", "20cm")
"""What is kept of one controller that was driven, in this order; the last four are 1 for success within that radius."""


@cuda.jit(device=True)
def _displaced(w, at, left, right, new_left, new_right, duration):  # type: ignore[no-untyped-def]  # compiled
    """Displacement that three networks from w[at] on foretell: to the right m, ahead m, counter-clockwise rad; float32."""
    return (
        output(w, at, _WIDTH, left, right, new_left, new_right, duration) * SCALE[0],
        output(w, at + _WIDTH, _WIDTH, left, right, new_left, new_right, duration) * SCALE[1],
        output(w, at + 2 * _WIDTH, _WIDTH, left, right, new_left, new_right, duration) * SCALE[2],
    )


@cuda.jit(device=True)
def scored(w, commands, length, goals):  # type: ignore[no-untyped-def]  # compiled
    """Fitness and goals reached of one controller (longest, 3) on networks w (3 W,): algorithm 2, as `Khepera.score`."""
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
    return fitness_of(total, goal, goals), goal


@cuda.jit(device=True)
def _noise(draws):  # type: ignore[no-untyped-def]  # compiled
    """Three standard normal numbers of four words, by Box and Muller, as `bns.engine.philox.normals`."""
    one = math.sqrt(-2.0 * math.log((draws[0] + 0.5) * _UNIT))
    other = math.sqrt(-2.0 * math.log((draws[2] + 0.5) * _UNIT))
    angle = (draws[1] + 0.5) * (_UNIT * 2.0 * math.pi)
    return one * math.cos(angle), other * math.cos((draws[3] + 0.5) * (_UNIT * 2.0 * math.pi)), one * math.sin(angle)


@cuda.jit(device=True)
def _learn(heading, dx, dy, turn, inputs, to_training, run, X, targets, counts):  # type: ignore[no-untyped-def]  # compiled
    """Add the pattern of a command, begun with that heading and moving by dx, dy, turn, to one of two sets; 1 if not finite."""
    sine, cosine = math.sin(heading), math.cos(heading)
    target = (
        np.float32((dx * sine - dy * cosine) / SCALE[0]),
        np.float32((dx * cosine + dy * sine) / SCALE[1]),
        np.float32(turn / SCALE[2]),
    )
    if not (math.isfinite(target[0]) and math.isfinite(target[1]) and math.isfinite(target[2])):
        return 1
    which = 0 if to_training else 1
    at = counts[which, run]
    for k in range(5):
        X[which, run, k, at] = inputs[k]
    for net in range(3):
        targets[which, run, net, at] = target[net]
    counts[which, run] = at + 1
    return 0


@cuda.jit
def drive(  # type: ignore[no-untyped-def]  # compiled
    evaluation, settings, purpose, learning, static, noise_sd, weights, commands, lengths, order, cdf, goals,
    X, targets, counts, failures, rows,
):  # fmt: skip
    """Drive a controller of each run in the substitute world; a thread a run.

    While ``learning`` it is the winner of the real-world tournament cdf (runs, n), and what it does joins the patterns X
    (2, runs, 5, capacity), targets (2, runs, 3, capacity), counts (2, runs): those to train on first, those to watch second.
    Otherwise it is the fittest. weights (runs, 3 W) are the networks, static (3 W,) and noise_sd (3,) the world; rows (runs,
    evaluations, 9) takes `DRIVEN`.
    """
    run = cuda.grid(1)
    if run >= settings.size or evaluation > settings[run]["evaluations"]:
        return
    own, step = settings[run], np.uint32(evaluation)
    n, key0, key1, aims = own["population"], own["key0"], own["key1"], goals[run, : own["goals"]]
    half = own["generations"] * (evaluation - 1 if learning else evaluation) % 2
    who = order[run, 0]
    if learning:
        word = philox(_FIRST, _FIRST, step, _PICK, key0, key1)[0]
        who = winner(order[run, :n], cdf[run, :n], word)
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
        noise = _noise(philox(np.uint32(j), _FIRST, step, purpose, key0, key1))
        to_right, ahead = to_right + noise[0] * noise_sd[0], ahead + noise[1] * noise_sd[1]
        turn = turn + noise[2] * noise_sd[2]
        dx, dy = step_of(to_right, ahead, math.sin(heading), math.cos(heading))
        if learning:
            to_training = philox(np.uint32(j), _FIRST, step, _SPLIT, key0, key1)[0] * _UNIT < TRAINING_SHARE
            inputs = (left, right, new_left, new_right, duration)
            failed = _learn(heading, dx, dy, turn, inputs, to_training, run, X, targets, counts)
            failures[run] += failed
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
    for k in range(4):
        row[5 + k] = visited[k] == aims.shape[0]
