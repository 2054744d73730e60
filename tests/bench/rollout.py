"""Fitness of 400 controllers of ten commands on three networks, and a generation against evosax's."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np

from bns.engine.breeding import breed
from bns.engine.evolution import Population, rank, tournament_cdf
from bns.engine.philox import Key
from bns.engine.snn import initial_weights
from bns.robots.khepera import ROBOT
from bns.tasks import load_task
from tests.bench.clock import alternating, one_core
from tests.bench.line import Line, at_most

POPULATION, COMMANDS, GENERATIONS = 400, 10, 20
KEY = Key(0, 0)


class Ours:
    """Our generation on a population that keeps its ten commands, so that both do the same work every time."""

    def __init__(self, weights: np.ndarray) -> None:
        self.weights, self.task = weights, load_task("khepera", "circle")
        self.population = ROBOT.random_controllers(KEY, POPULATION, COMMANDS)
        self.children = Population(self.population.commands.copy(), self.population.lengths.copy())
        self.cdf = tournament_cdf(POPULATION, 0.5)
        self.scores = ROBOT.score(self.population, weights, self.task)
        self.order = rank(self.scores.fitness)

    def rollout(self) -> np.ndarray:
        """Fitness (n,)."""
        return ROBOT.score(self.population, self.weights, self.task).fitness

    def rollouts(self) -> None:
        """As many as there are generations in a call."""
        for _ in range(GENERATIONS):
            self.rollout()

    def generations(self) -> None:
        """Breed, score and rank as a run does; always from the same parents, whose children have ten commands on average."""
        for generation in range(GENERATIONS):
            breed(KEY, self.population, self.order, self.cdf, 0.1, ROBOT.bounds, 4, generation, self.children)
            rank(ROBOT.score(self.children, self.weights, self.task, None, self.scores).fitness)


def normalised(commands: np.ndarray) -> np.ndarray:
    """Device units to -1..1."""
    low, high = ROBOT.bounds.low, ROBOT.bounds.high
    return (commands - low) / (high - low) * 2 - 1


def measure(quick: bool) -> list[Line]:
    """Milliseconds a rollout, the same rollout in JAX, and evosax's generation in ours."""
    ours = Ours(initial_weights(KEY, 3, ROBOT.hidden))
    subjects = {"rollout": ours.rollouts, "generation": ours.generations}
    with one_core():
        taken = alternating(subjects | _peers(ours), 7 if quick else 21)
    ms = {name: call_s / GENERATIONS * 1e3 for name, call_s in taken.items()}
    return [
        at_most(f"rollout of {POPULATION} x {COMMANDS} commands x 3 networks", ms["rollout"], 0.5, "ms"),
        _against("  against evosax's generation with the same rollout", ms, "rollout", "evosax"),
        _against("    of which the rollout in JAX", ms, "rollout", "jax", None),
        _against("  a whole generation against evosax", ms, "generation", "evosax"),
    ]


def _against(name: str, ms: dict[str, float], subject: str, peer: str, target: float | None = 5) -> Line:
    if peer not in ms:
        return Line(name, None, target, "x", False, note="evosax is not installed; pip install -e '.[bench]'")
    return Line(name, ms[peer] / ms[subject], target, "x", False, note=f"ours {ms[subject]:.2f} ms, peer {ms[peer]:.2f} ms")


def _peers(ours: Ours) -> dict[str, Callable[[], object]]:
    """Nothing where evosax is not installed."""
    if not find_spec("evosax"):
        return {}
    from tests.bench.evosax_peer import check_peer, fitness_of, generations, rollouts

    commands = normalised(ours.population.commands)
    fitness = fitness_of(ours.weights, ours.task.goals_m)
    check_peer(fitness, commands, ours.rollout())
    return {
        "jax": rollouts(fitness, commands, GENERATIONS),
        "evosax": generations(fitness, commands, GENERATIONS),
    }
