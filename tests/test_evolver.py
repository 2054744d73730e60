"""A population on a simulator: what each generation leaves behind, and under which draws it is scored and planned."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from bns.bootstrap.evolver import Evolver
from bns.engine.philox import Key
from bns.robots import load_robot
from bns.robots.base import Scores
from bns.spec import RunSpec
from bns.tasks import load_task

ROBOT, TASK, KEY = load_robot("khepera"), load_task("khepera", "circle"), Key(5, 2)
SPEC = RunSpec(population_size=6, generations_per_evaluation=3, record="full")


@dataclass
class Lengths:
    """Finds longer lists fitter, and notes the draws that it is asked under."""

    scored: list = field(default_factory=list)
    planned: list = field(default_factory=list)

    def score(self, population, stream=None, parents=None):
        self.scored.append(stream.step)
        return Scores(population.lengths.astype(float), np.zeros(len(population), np.int32), 0)

    def plan(self, controller, stream=None):
        self.planned.append(stream.step)
        return controller


@pytest.fixture
def evolved():
    """After two rounds of three generations, and the simulator."""
    simulator = Lengths()
    evolver = Evolver.start(ROBOT, TASK, KEY, SPEC, simulator)
    for _ in range(2):
        evolver.evolve(simulator)
    return evolver, simulator


def test_the_history_is_that_of_the_last_round(evolved):
    evolver, _ = evolved
    assert [one.number for one in evolver.history] == [4, 5, 6]
    assert evolver.generations == 6


def test_a_generation_is_remembered_with_its_best_controller_and_the_best_and_mean_fitness(evolved):
    evolver, _ = evolved
    for one in evolver.history:
        assert one.best_fitness == len(one.best) >= one.mean_fitness
    last, lengths = evolver.history[-1], evolver.population.lengths
    assert (last.best_fitness, last.mean_fitness) == (lengths.max(), lengths.mean())
    assert lengths.max() > lengths.mean()
    np.testing.assert_array_equal(last.best, evolver.population.controller(int(lengths.argmax())))


def test_a_generation_is_scored_under_draws_of_its_own_and_planned_under_the_same(evolved):
    evolver, simulator = evolved
    assert simulator.scored == [0, 0, 1, 2, 3, 3, 4, 5, 6]  # each round begins with another look at the last generation
    evolver.plan(evolver.fittest(), simulator)
    for one in evolver.history:
        evolver.plan(one.best, simulator, one.number)
    assert simulator.planned == [6, 4, 5, 6]


def test_only_what_is_recorded_in_full_has_a_history():
    simulator = Lengths()
    evolver = Evolver.start(ROBOT, TASK, KEY, RunSpec(population_size=6, generations_per_evaluation=1), simulator)
    evolver.evolve(simulator)
    assert (evolver.generations, evolver.history) == (1, [])
