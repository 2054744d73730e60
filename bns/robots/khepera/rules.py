"""What one command and one path of a Khepera III come to: the scalar rules of algorithm 2, for every engine."""

from __future__ import annotations

import math

import numpy as np

from bns.engine.jit import inline

GOAL_RADIUS_M = 0.07


def squared_reach_m2(radius_m: float) -> float:
    """The largest number whose root is not above a radius: to compare squares with it is to compare distances, bit for bit."""
    square = math.nextafter(radius_m**2, 0.0)
    while math.sqrt(math.nextafter(square, 1.0)) <= radius_m:
        square = math.nextafter(square, 1.0)
    return square


SQUARED_REACH_M2 = squared_reach_m2(GOAL_RADIUS_M)
MISSED_GOAL_M = 10.0
"""Penalty for a goal not reached, in metres of distance: more than any path on the surface adds up to, so that one goal
more always outweighs a shorter path. The dissertation says "a large constant"."""
SMALLEST_SUM_M = 0.01
"""The distance sum that fitness is the inverse of is kept above this, so that fitness never exceeds 100 per metre."""
LARGEST_HEADING_RAD = 1e5
"""A controller whose heading in simulation runs beyond this counts as failed arithmetic: its networks have diverged."""
START = (0.0, 0.0, math.pi / 2)
"""Start of every task: between the goals, facing north."""

LOW = np.array([3000.0, 3000.0, 400.0], np.float32)
HIGH = np.array([30000.0, 30000.0, 3000.0], np.float32)
"""Least and largest left speed, right speed (firmware's units) and duration (ms)."""
CENTRE, PER_UNIT = (LOW + HIGH) / 2, 2 / (HIGH - LOW)
SCALE = np.array([0.2, 0.3, 3.0], np.float32)
"""Metres, metres and radians that an output of 1 stands for: the order of what random commands do."""


@inline
def normalised(command, centre, per_unit):  # type: ignore[no-untyped-def]  # compiled
    """Left, right and duration as the networks see them."""
    return (
        (command[0] - centre[0]) * per_unit[0],
        (command[1] - centre[1]) * per_unit[1],
        (command[2] - centre[2]) * per_unit[2],
    )


@inline
def at_rest(centre, per_unit):  # type: ignore[no-untyped-def]  # compiled
    """The previous left and right of a first command."""
    return -centre[0] * per_unit[0], -centre[1] * per_unit[1]


@inline
def unbranched_sine(x):  # type: ignore[no-untyped-def]  # compiled
    """Sine to 1e-11 for |x| below LARGEST_HEADING_RAD, without a branch, so that it vectorises."""
    half_turns = np.int32(x / math.pi + 1048576.5) - 1048576
    r = x - half_turns * math.pi
    s = r * r
    p = -1 / 1307674368000 * s + 1 / 6227020800
    p = p * s - 1 / 39916800
    p = p * s + 1 / 362880
    p = p * s - 1 / 5040
    p = p * s + 1 / 120
    p = p * s - 1 / 6
    return (r + r * s * p) * (1.0 - 2.0 * (half_turns & 1))


@inline
def step_of(right, ahead, sine, cosine):  # type: ignore[no-untyped-def]  # compiled
    """Step in the world, x and y, of a displacement in the frame of a robot with that heading."""
    return ahead * cosine + right * sine, ahead * sine - right * cosine


@inline
def aim_of(goal, goals):  # type: ignore[no-untyped-def]  # compiled
    """Where the goal is that is next to be reached; after the last, the last."""
    aim = min(goal, goals.shape[0] - 1)
    return goals[aim, 0], goals[aim, 1]


@inline
def squared_distance(x, y, aim_x, aim_y):  # type: ignore[no-untyped-def]  # compiled
    """Square of the distance between two places."""
    ahead, aside = x - aim_x, y - aim_y
    return ahead * ahead + aside * aside


@inline
def aimed(x, y, goal, goals):  # type: ignore[no-untyped-def]  # compiled
    """The goal that a position leaves to be reached, and the distance to it or, after the last, to the last (algorithm 2)."""
    aim_x, aim_y = aim_of(goal, goals)
    squared = squared_distance(x, y, aim_x, aim_y)
    if squared <= SQUARED_REACH_M2 and goal < goals.shape[0]:
        goal += 1
        aim_x, aim_y = aim_of(goal, goals)
        squared = squared_distance(x, y, aim_x, aim_y)
    return goal, math.sqrt(squared)


@inline
def fitness_of(total, goal, goals):  # type: ignore[no-untyped-def]  # compiled
    """Fitness of a path with that sum of distances that reached so many goals; 0 where the arithmetic failed."""
    total += MISSED_GOAL_M * (goals.shape[0] - goal)
    return 1.0 / max(total, SMALLEST_SUM_M) if math.isfinite(total) else 0.0
