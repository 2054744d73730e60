"""Which of some controllers the robot would learn most from: the one that a committee of networks disagrees on most.

Query by committee (Seung, Opper and Sompolinsky 1992), as Bongard and Lipson use it for tests of models. The committee is
the ensemble where there is one. Else it is the networks of the latest rounds, which cost nothing: where training still moves
a prediction, data has not pinned it down.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bns.engine.evolution import Population
from bns.engine.snn import predict
from bns.robots.base import Robot

SNAPSHOTS = 4
"""Rounds whose networks are the committee of a run with one network for each displacement."""


def disagreement(
    robot: Robot, committee: Sequence[np.ndarray], population: Population, who: np.ndarray
) -> np.ndarray:
    """Variance over the committee (networks, W) of the networks' outputs, summed over all commands, of controllers who (n,).

    A sum, because every command of a drive is measured: more commands teach more.
    """
    controllers = [population.controller(int(one)) for one in who]
    X = np.hstack([robot.inputs(commands) for commands in controllers])
    said = np.stack([predict(networks, X, robot.sigmoid_output) for networks in committee]).astype(np.float64)
    of_commands = said.var(axis=0).sum(axis=0)
    ends = np.cumsum([len(commands) for commands in controllers])
    return np.add.reduceat(of_commands, [0, *ends[:-1]])


def most_informative(
    robot: Robot, committee: Sequence[np.ndarray], population: Population, order: np.ndarray, share: float
) -> int | None:
    """Of a population's share that is best, by its order, the controller that the committee disagrees on most; of equals the
    fittest. None where there is no committee of two."""
    if len(committee) < 2:
        return None
    who = order[: max(1, round(share * len(order)))]
    return int(who[np.argmax(disagreement(robot, committee, population, who))])
