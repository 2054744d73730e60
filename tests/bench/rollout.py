"""Fitness of 400 controllers of ten commands on three networks, and a generation against evosax's."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np

from bns.engine.evolution import Population, breed, rank, tournament_cdf
from bns.engine.philox import Key
from bns.engine.snn import initial_weights
from bns.robots.khepera import ROBOT
from bns.tasks import load_task
from tests.bench.clock import alternating, one_core
from tests.bench.line import Line, at_least, at_most

POPULATION, COMMANDS, GENERATIONS = 400, 10, 20
KEY = Key(0, 0)


class Ours:
    """Our generation on a population that keeps its ten commands, so that both do the same work every time."""

    def __init__(self, weights: np.ndarray) -> None:
        self.weights, self.task = weights, load_task("khepera", "circle")
        self.population = ROBOT.random_controllers(KEY, POPULATION, COMMANDS)
        self.children = Population(self.population.commands.copy(), self.population.lengths.copy())
        self.cdf = tournament_cdf(POPULATION, 0.5)

    def rollout(self) -> np.ndarray:
        """Fitness (n,)."""
        return ROBOT.score(self.population, self.weights, self.task).fitness

    def rollouts(self) -> None:
        """As many as there are generations in a call."""
        for _ in range(GENERATIONS):
            self.rollout()

    def generations(self) -> None:
        """Score, rank, breed; always from the same parents, whose children have ten commands on average."""
        for generation in range(GENERATIONS):
            order = rank(self.rollout())
            breed(KEY, self.population, order, self.cdf, 0.1, ROBOT.bounds, 4, generation, self.children)


def normalised(commands: np.ndarray) -> np.ndarray:
    """Device units to -1..1."""
    low, high = ROBOT.bounds.low, ROBOT.bounds.high
    return (commands - low) / (high - low) * 2 - 1


def measure(quick: bool) -> list[Line]:
    """Milliseconds a rollout, and evosax's generation in ours."""
    ours = Ours(initial_weights(KEY, 3, ROBOT.hidden))
    subjects = {"rollout": ours.rollouts, "generation": ours.generations}
    title = f"  a whole generation against evosax {'' if find_spec('evosax') else '(not installed)'}".rstrip()
    if not find_spec("evosax"):
        with one_core():
            taken = alternating(subjects, 11)
        peer = at_least(title, None, 5, note="not installed; pip install -e '.[bench]'")
    else:
        with one_core():
            taken = alternating(subjects | {"evosax": _peer(ours)}, 7 if quick else 21)
        note = f"ours {_ms(taken['generation']):.2f} ms, peer {_ms(taken['evosax']):.2f} ms"
        peer = at_least(title, taken["evosax"] / taken["generation"], 5, note=note)
    return [
        at_most(f"rollout of {POPULATION} x {COMMANDS} commands x 3 networks", _ms(taken["rollout"]), 0.5, "ms"),
        peer,
    ]


def _peer(ours: Ours):
    from tests.bench.evosax_peer import check_peer, fitness_of, generations

    commands = normalised(ours.population.commands)
    fitness = fitness_of(ours.weights, ours.task.goals_m)
    check_peer(fitness, commands, ours.rollout())
    return generations(fitness, commands, GENERATIONS)


def _ms(call_s: float) -> float:
    return call_s / GENERATIONS * 1e3
