"""Children that lose commands: on the way to a list that is as short as its task allows, each command that goes takes noise away.

Crossover hardly ever leaves a single command out, and where success counts for much, lists grow: behind the last goal, further
commands cost little and are now and then a second chance.
"""

from __future__ import annotations

import numpy as np

from bns.engine.evolution import Population
from bns.engine.philox import Key, Purpose, uniforms


def shorten(population: Population, share: float, shortest: int, key: Key, generation: int) -> None:
    """Take commands out of this share of a population's lists, in place: all from some place on, or one, as often each.

    The first list, which is the elite, stays, and so do lists that are no longer than the shortest allowed.
    """
    draws = uniforms(key, Purpose.APPROACH, generation, len(population), 1)[:, 0]
    loses = (draws[:, 0] < share) & (population.lengths > shortest)
    loses[0] = False
    for i in np.flatnonzero(loses):
        commands, origin, length = population.commands[i], population.origin[i], int(population.lengths[i])
        if draws[i, 1] < 0.5:
            population.lengths[i] = shortest + int(draws[i, 2] * (length - shortest))
            continue
        out = int(draws[i, 2] * length)
        commands[out : length - 1] = commands[out + 1 : length].copy()
        origin[out:] = -1  # the next command follows another one now
        population.lengths[i] = length - 1
