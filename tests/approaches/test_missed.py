"""Missed goals that count more under noise: ``approach: bns+missed=...``."""

from dataclasses import replace

import numpy as np
import pytest

from bns.approaches import start_approach
from bns.approaches.parts.noisy import NoisySimulator
from bns.bootstrap.loop import run
from bns.bootstrap.simulators import NetworkSimulator
from bns.engine.philox import Key
from bns.errors import SpecError
from bns.robots import load_robot
from bns.robots.base import RandomStream, Scores
from bns.robots.khepera.noisy import Expected
from bns.robots.simulator import load_static_simulator
from bns.spec import RunSpec
from bns.tasks import load_task

SMALL = {"evaluations": 6, "population_size": 20, "generations_per_evaluation": 3, "training_iterations_per_evaluation": 5}
KHEPERA, CIRCLE, KEY = load_robot("khepera"), load_task("khepera", "circle"), Key(3, 4)
STREAM, SD, ROWS = RandomStream(KEY, 17), np.array([0.02, 0.03, 0.1]), 6
STILL = load_static_simulator("khepera").weights


class Told:
    """A robot whose simulations under noise are told."""

    def __init__(self, **given):
        self.found = Expected(**{name: np.array(values) for name, values in given.items()}, failures=0)

    def score(self, population, weights, task, stream=None, parents=None):
        return Scores(np.zeros(2), np.zeros(2, np.int32), 0, outputs=np.zeros((3, 0), np.float32))

    def expected(self, *given):
        return self.found


def fitness(robot, missed_m):
    networks = NetworkSimulator(robot, CIRCLE, STILL)
    return NoisySimulator(networks, SD, ROWS, missed_m=missed_m).score(None, STREAM).fitness


def test_a_goal_missed_on_the_mean_and_the_share_of_failures_cost_as_much_each():
    robot = Told(fitness=[1 / 5, 0.0], goals_reached=[3.75, 0.0], success=[0.8, 0.0])
    assert 1 / fitness(robot, 100.0)[0] == pytest.approx(5 + 100 * 0.25 + 100 * 0.2)
    assert fitness(robot, 100.0)[1] == 0  # failed arithmetic ranks last, whatever it reached
    assert fitness(robot, 0.0) is robot.found.fitness


def test_the_surer_of_two_paths_is_the_fitter_one_though_it_is_longer():
    robot = Told(fitness=[1 / 4.5, 1 / 5], goals_reached=[3.9, 4.0], success=[0.9, 1.0])
    assert fitness(robot, 0.0)[0] > fitness(robot, 0.0)[1]
    assert fitness(robot, 100.0)[0] < fitness(robot, 100.0)[1]


def test_it_is_the_price_of_this_population_s_own_misses():
    population, wide = KHEPERA.initial_population(Key(1, 1), 60, 4, 40), replace(CIRCLE, radius_m=0.3)
    simulator = NoisySimulator(NetworkSimulator(KHEPERA, wide, STILL), SD, ROWS)
    plain, dear = (replace(simulator, missed_m=price).score(population, STREAM) for price in (0.0, 30.0))
    found = KHEPERA.expected(population, plain.outputs, wide, SD, ROWS, STREAM)
    price = 30 * (4 - found.goals_reached) + 30 * (1 - found.success)
    np.testing.assert_allclose(1 / dear.fitness, 1 / plain.fitness + price, rtol=1e-12)
    np.testing.assert_array_equal(dear.goals_reached, plain.goals_reached)
    assert len(set(found.success)) > 1  # else little was compared


def test_a_run_evolves_with_the_price_that_its_name_says():
    spec = RunSpec(**SMALL | {"approach": "bns+noise=2+missed=70"})
    assert start_approach(KHEPERA, CIRCLE, KEY, spec).simulator.missed_m == 70


def test_none_by_default_and_the_same_numbers_then():
    best = {
        name: list(run(RunSpec(approach=name, **SMALL)).tables["evals"]["best_fitness"])
        for name in ("bns+noise=3", "bns+noise=3+missed=0", "bns+noise=3+missed=100")
    }
    assert best["bns+noise=3"] == best["bns+noise=3+missed=0"] != best["bns+noise=3+missed=100"]


@pytest.mark.parametrize(
    ("approach", "said"),
    [
        ("bns+missed=100", "goals are missed under noise, of which there is none; add some, such as noise=16"),
        ("bns+noise=4+missed=2000", "missed is '2000'; it must be a number from 0 to 1000"),
    ],
)
def test_what_cannot_be_is_refused(approach, said):
    with pytest.raises(SpecError, match=said):
        run(RunSpec(approach=approach, **SMALL))
