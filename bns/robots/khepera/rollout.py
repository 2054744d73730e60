"""Compiled: algorithm 2 for whole populations."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bns.engine.evolution import Population
from bns.engine.jit import copy_items, exact, fast
from bns.engine.snn import INPUTS, predict_into
from bns.robots.khepera.rules import (
    CENTRE,
    GOAL_RADIUS_M,
    LARGEST_HEADING_RAD,
    MISSED_GOAL_M,
    PER_UNIT,
    SCALE,
    START,
    aim_of,
    at_rest,
    fitness_of,
    squared_distance,
    squared_reach_m2,
    step_of,
    unbranched_sine,
)

NOTHING = np.empty((3, 0), np.float32)
"""Outputs of no command."""


@exact
def _side_by_side(lists, lengths, origin, commands, source):  # type: ignore[no-untyped-def]  # compiled
    """All commands of all controllers, list after list and nothing between, into `commands`, and their origins into `source`."""
    longest, width, n = origin.shape[1], lists.shape[2], 0
    every, every_origin = lists.reshape(-1), origin.reshape(-1)
    for i in range(lengths.size):
        copy_items(commands, n * width, every, i * longest * width, lengths[i] * width)
        copy_items(source, n, every_origin, i * longest, lengths[i])
        n += lengths[i]


@fast
def _normalise(commands, lengths, centre, per_unit, X):  # type: ignore[no-untyped-def]  # compiled
    """Inputs of commands side by side: previous left and right (0 at first), left, right, duration."""
    last_left, last_right, left, right, duration = X[0], X[1], X[2], X[3], X[4]
    for c in range(left.size):
        left[c] = (commands[3 * c] - centre[0]) * per_unit[0]
        right[c] = (commands[3 * c + 1] - centre[1]) * per_unit[1]
        duration[c] = (commands[3 * c + 2] - centre[2]) * per_unit[2]
    for c in range(1, left.size):
        last_left[c], last_right[c] = left[c - 1], right[c - 1]
    n = 0
    for i in range(lengths.size):
        if lengths[i] > 0:
            last_left[n], last_right[n] = at_rest(centre, per_unit)
        n += lengths[i]


@exact
def _new(source, known, which):  # type: ignore[no-untyped-def]  # compiled
    """Which commands' origin is not among the `known` ones, and how many: without a branch, which would be guessed wrongly."""
    count = 0
    for c in range(source.size):
        which[count] = c
        count += int(not 0 <= source[c] < known)
    return count


@exact
def _columns(X, which):  # type: ignore[no-untyped-def]  # compiled
    some = np.empty((X.shape[0], which.size), np.float32)
    for r in range(X.shape[0]):
        row, kept = X[r], some[r]
        for m in range(which.size):
            kept[m] = row[np.uint64(which[m])]
    return some


@exact
def _complete(outputs, known, source, fresh, which):  # type: ignore[no-untyped-def]  # compiled
    """Outputs of all commands: the known ones from where they come from, the fresh ones where they belong."""
    right, ahead, turn = outputs[0], outputs[1], outputs[2]
    old_right, old_ahead, old_turn = known[0], known[1], known[2]
    for c in range(source.size):
        old = np.uint64(max(source[c], 0))
        right[c], ahead[c], turn[c] = old_right[old], old_ahead[old], old_turn[old]
    new_right, new_ahead, new_turn = fresh[0], fresh[1], fresh[2]
    for m in range(which.size):
        at = np.uint64(which[m])
        right[at], ahead[at], turn[at] = new_right[m], new_ahead[m], new_turn[m]


@fast
def _directions(heading, sine, cosine):  # type: ignore[no-untyped-def]  # compiled
    for c in range(heading.size):
        sine[c] = unbranched_sine(heading[c])
        cosine[c] = unbranched_sine(heading[c] + math.pi / 2)


@exact
def _headings(turns, starts, lengths, scale, heading, astray):  # type: ignore[no-untyped-def]  # compiled
    """Heading at the start of every command; infinite in `astray` for controllers that one leads out of bounds, 0 for others."""
    for i in range(lengths.size):
        angle, furthest = START[2], 0.0
        for c in range(starts[i], starts[i] + lengths[i]):
            heading[c] = angle
            furthest = max(furthest, abs(angle))
            angle += turns[c] * scale
        astray[i] = np.inf if furthest > LARGEST_HEADING_RAD else 0.0


@exact
def _steps(outputs, scale, sine, cosine):  # type: ignore[no-untyped-def]  # compiled
    """Steps in the world, in place of the directions: x in `cosine`, y in `sine`; apart from the walk, so that it vectorises."""
    to_right, forward = outputs[0], outputs[1]
    for c in range(sine.size):
        right, ahead = to_right[c] * scale[0], forward[c] * scale[1]
        cosine[c], sine[c] = step_of(right, ahead, sine[c], cosine[c])


@exact
def _distances(step_x, step_y, starts, lengths, goals, squared_reach, reached, distance):  # type: ignore[no-untyped-def]  # compiled
    """Distance to the goal after every command, and how many goals each controller reaches: `aimed` along many paths.

    The goal's place is kept and a goal reached is a branch, hardly ever taken: one place chosen out of several after every
    command makes each wait for the one before. Roots are taken of all distances at once.
    """
    for i in range(lengths.size):
        x, y, goal = START[0], START[1], 0
        aim_x, aim_y = aim_of(goal, goals)
        for c in range(starts[i], starts[i] + lengths[i]):
            x += step_x[c]
            y += step_y[c]
            squared = squared_distance(x, y, aim_x, aim_y)
            if squared <= squared_reach and goal < goals.shape[0]:
                goal += 1
                aim_x, aim_y = aim_of(goal, goals)
                squared = squared_distance(x, y, aim_x, aim_y)
            distance[c] = squared
        reached[i] = goal
    for c in range(distance.size):
        distance[c] = math.sqrt(distance[c])


@exact
def walk_all(outputs, lengths, scale, goals, squared_reach, extra_m, fitness, reached):  # type: ignore[no-untyped-def]  # compiled
    """Algorithm 2 for every controller; how many could not be computed. extra_m: by how much the penalty is another one."""
    count, starts = outputs.shape[1], np.cumsum(lengths) - lengths
    heading, step_y, step_x = np.empty(count), np.empty(count), np.empty(count)
    astray = np.empty(lengths.size)
    _headings(outputs[2], starts, lengths, scale[2], heading, astray)
    _directions(heading, step_y, step_x)
    _steps(outputs, scale, step_y, step_x)
    _distances(step_x, step_y, starts, lengths, goals, squared_reach, reached, heading)
    failures = 0
    for i in range(lengths.size):
        total = astray[i]
        for c in range(starts[i], starts[i] + lengths[i]):
            total += heading[c]
        total += extra_m * (goals.shape[0] - reached[i])
        fitness[i] = fitness_of(total, reached[i], goals)
        failures += fitness[i] == 0.0
    return failures


@exact
def _outputs(commands, lengths, origin, known, weights, centre, per_unit):  # type: ignore[no-untyped-def]  # compiled
    """Outputs (networks, commands) of the networks for all commands; only those that are not known are computed."""
    total = lengths.sum()
    side_by_side = np.empty(total * commands.shape[2], np.float32)
    X, source, which = np.empty((INPUTS, total), np.float32), np.empty(total, np.int32), np.empty(total, np.int32)
    _side_by_side(commands, lengths, origin, side_by_side, source)
    _normalise(side_by_side, lengths, centre, per_unit, X)
    new = total if known.shape[1] == 0 else _new(source, known.shape[1], which)
    fresh = np.empty((weights.shape[0], new), np.float32)
    if new == total:
        predict_into(weights, X, total, fresh)
        return fresh
    predict_into(weights, _columns(X, which[:new]), new, fresh)
    outputs = np.empty((weights.shape[0], total), np.float32)
    _complete(outputs, known, source, fresh, which[:new])
    return outputs


@exact
def _rolled_out(  # type: ignore[no-untyped-def]  # compiled
    commands, lengths, origin, known, weights, centre, per_unit, scale, goals, squared_reach, extra_m, fitness, reached
):
    outputs = _outputs(commands, lengths, origin, known, weights, centre, per_unit)
    return outputs, walk_all(outputs, lengths, scale, goals, squared_reach, extra_m, fitness, reached)


class Rollout(NamedTuple):
    """Per controller fitness (n,), 0 where the arithmetic failed, and goals reached (n,); how many failed; what the networks
    said of all commands, (networks, commands)."""

    fitness: np.ndarray
    reached: np.ndarray
    failures: int
    outputs: np.ndarray


def roll_out(
    population: Population,
    weights: np.ndarray,
    goals_m: np.ndarray,
    known: np.ndarray | None,
    penalty_m: float = MISSED_GOAL_M,
    radius_m: float = GOAL_RADIUS_M,
) -> Rollout:
    """Algorithm 2 on networks (3, W), with ``penalty_m`` for every goal missed, passed within ``radius_m``.

    known (3, commands): what the same networks said of all commands of the generation that this one was bred from. An output
    does not depend on where in a batch its command stands, so taking it over and computing it anew give the same number.
    """
    fitness, reached = np.empty(len(population)), np.empty(len(population), np.int32)
    outputs, failures = _rolled_out(
        population.commands,
        population.lengths,
        population.origin,
        NOTHING if known is None else known,
        weights,
        CENTRE,
        PER_UNIT,
        SCALE,
        goals_m,
        squared_reach_m2(radius_m),
        penalty_m - MISSED_GOAL_M,
        fitness,
        reached,
    )
    return Rollout(fitness, reached, int(failures), outputs)


def walked(
    population: Population, outputs: np.ndarray, goals_m: np.ndarray, penalty_m: float = MISSED_GOAL_M,
    radius_m: float = GOAL_RADIUS_M,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Algorithm 2 on outputs (3, commands) that are known: fitness (n,), goals reached (n,), how many failed."""
    fitness, reached = np.empty(len(population)), np.empty(len(population), np.int32)
    reach, extra_m = squared_reach_m2(radius_m), penalty_m - MISSED_GOAL_M
    failures = walk_all(np.ascontiguousarray(outputs), population.lengths, SCALE, goals_m, reach, extra_m, fitness, reached)
    return fitness, reached, int(failures)


def inputs(commands: np.ndarray) -> np.ndarray:
    """Inputs (5, n) of the networks for one controller's commands (n, 3)."""
    X, lengths = np.empty((INPUTS, len(commands)), np.float32), np.array([len(commands)], np.int32)
    _normalise(np.ascontiguousarray(commands, np.float32).ravel(), lengths, CENTRE, PER_UNIT, X)
    return X
