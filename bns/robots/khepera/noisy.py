"""Compiled: algorithm 2 as the mean over noisy simulations, all controllers under the same noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bns.engine.evolution import Population
from bns.engine.jit import exact
from bns.robots.khepera.rollout import walk_all
from bns.robots.khepera.rules import GOAL_RADIUS_M, MISSED_GOAL_M, SCALE, squared_reach_m2


@exact
def _disturb(outputs, lengths, noise, disturbed):  # type: ignore[no-untyped-def]  # compiled
    """Outputs (3, commands) with one row of noise (3, longest) added to every list, from its first command on."""
    for d in range(outputs.shape[0]):
        source, target, added, first = outputs[d], disturbed[d], noise[d], 0
        for i in range(lengths.size):
            for j in range(lengths[i]):
                target[first + j] = source[first + j] + added[j]
            first += lengths[i]


@exact
def _mean_over_noise(  # type: ignore[no-untyped-def]  # compiled
    outputs, lengths, scale, noise, goals, squared_reach, extra_m, fitness, goals_reached, success
):
    """Means over the rows of noise (rows, 3, longest); how many controllers could not be computed under one of them."""
    rows, failures = noise.shape[0], 0
    disturbed, once, reached = np.empty_like(outputs), np.empty(lengths.size), np.empty(lengths.size, np.int32)
    fitness[:], goals_reached[:], success[:] = 0.0, 0.0, 0.0
    for row in range(rows):
        _disturb(outputs, lengths, noise[row], disturbed)
        walk_all(disturbed, lengths, scale, goals, squared_reach, extra_m, once, reached)
        for i in range(lengths.size):
            fitness[i] += 1.0 / once[i]  # the sum of distances; infinite where the arithmetic failed
            goals_reached[i] += reached[i] / rows
            success[i] += (reached[i] == goals.shape[0]) / rows
    for i in range(lengths.size):
        fitness[i] = rows / fitness[i]
        failures += fitness[i] == 0.0
    return failures


class Expected(NamedTuple):
    """Per controller (n,): fitness, the inverse of the mean sum of distances, 0 where the arithmetic failed; mean goals reached;
    share of the noisy simulations in which all are reached. Last, how many controllers failed."""

    fitness: np.ndarray
    goals_reached: np.ndarray
    success: np.ndarray
    failures: int


def expected(
    population: Population,
    outputs: np.ndarray,
    noise: np.ndarray,
    goals_m: np.ndarray,
    penalty_m: float = MISSED_GOAL_M,
    radius_m: float = GOAL_RADIUS_M,
) -> Expected:
    """Algorithm 2 on outputs (3, commands), under each row of noise (rows, 3, longest) in units of outputs.

    The sums of distances are averaged, not their inverses: of these, the mean rewards a short path as much as a sure one.
    """
    fitness, reached, success = (np.empty(len(population)) for _ in range(3))
    failures = _mean_over_noise(
        np.ascontiguousarray(outputs), population.lengths, SCALE, np.ascontiguousarray(noise, np.float32), goals_m,
        squared_reach_m2(radius_m), penalty_m - MISSED_GOAL_M, fitness, reached, success,
    )  # fmt: skip
    return Expected(fitness, reached, success, int(failures))
