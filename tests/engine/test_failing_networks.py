"""Trainer and evolver: the best is kept, and arithmetic that fails is counted and survived."""

import numpy as np
import pytest

from bns.bootstrap.evolver import Evolver
from bns.bootstrap.simulators import NetworkSimulator
from bns.bootstrap.trainer import Trainer
from bns.engine.philox import Key, Purpose
from bns.engine.snn import initial_weights
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task
from bns.worlds import build_world

ROBOT, KEY = load_robot("khepera"), Key(5, 1)


TASK = load_task("khepera", "circle")


def evolver(weights, **changes):
    spec = RunSpec(population_size=60, generations_per_evaluation=1, max_commands=30, **changes)
    return Evolver.start(ROBOT, TASK, Key(2, 1), spec, NetworkSimulator(ROBOT, TASK, weights))


@pytest.mark.parametrize("rate", [0.0, 0.1, 1.0])
def test_best_fitness_never_falls_while_the_networks_stay(rate):
    weights = initial_weights(Key(0, 1), 3, 20)
    some, best = evolver(weights, mutation_rate=rate), []
    for _ in range(60):
        some.evolve(NetworkSimulator(ROBOT, TASK, weights))
        best.append(some.best_fitness)
    # The elite's place in the batch moves its float32 outputs by an ulp or two.
    assert (np.diff(best) >= -1e-5 * np.array(best[1:])).all()
    assert best[-1] > best[0] * 1.01
    assert some.generations == 60


def test_a_population_on_failed_networks_goes_on_and_recovers():
    good = initial_weights(Key(0, 1), 3, 20)
    some = evolver(good)
    some.evolve(NetworkSimulator(ROBOT, TASK, np.full_like(good, np.nan)))
    assert (some.best_fitness, some.mean_fitness) == (0, 0)
    assert some.failures == 120  # scored before and after the generation
    assert len(some.pick(1)) >= 1
    some.evolve(NetworkSimulator(ROBOT, TASK, good))
    assert some.best_fitness > 0
    assert some.failures == 120
    assert some.population.lengths.min() >= 4


def trainer(n=20):
    """Networks that have seen n random commands and were not trained on them yet."""
    some = Trainer.start(ROBOT, KEY, RunSpec(training_iterations_per_evaluation=30))
    commands = ROBOT.random_controllers(KEY, 1, n).controller(0)
    some.add(commands, build_world("substitute", ROBOT).drive(commands, KEY, Purpose.WORLD_EVALUATED, 1), 1)
    return some


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", [0, 5, 6, -1])
def test_a_diverged_network_begins_anew_and_is_counted(value, place):
    some, healthy = trainer(), trainer()
    untrained = some.rule.weights[1].copy()
    some.rule.weights[1, place] = value
    some.train()
    healthy.train()
    assert some.failures == 1
    np.testing.assert_array_equal(some.rule.weights[1], untrained)
    np.testing.assert_array_equal(some.rule.weights[[0, 2]], healthy.rule.weights[[0, 2]])
    some.train()
    np.testing.assert_array_equal(some.rule.weights[1], healthy.rule.weights[1])
    assert some.failures == 1


def with_targets(size, n):
    """A trainer whose targets all have this size."""
    some = trainer(n)
    patterns = some.data.training
    patterns.targets[:, : patterns.count] = np.float32(size) * np.sign(patterns.inputs[2, : patterns.count])
    return some


@pytest.mark.parametrize("size", [1e10, 1e30, 3e38])
@pytest.mark.parametrize("n", [20, 400])
def test_enormous_targets_leave_finite_networks_and_errors(size, n):
    some = with_targets(size, n)
    for _ in range(3):
        some.train()
        assert np.isfinite(some.rule.weights).all()
        assert np.isfinite(some.errors()).all()


def test_gradients_that_overflow_are_counted_each_time():
    some = with_targets(3e38, 400)
    some.train()
    assert some.failures == 3
    some.train()
    assert some.failures == 6


def test_evolution_works_on_a_copy_of_the_networks():
    some = trainer()
    taken = some.evolution_weights()
    before = taken.copy()
    some.train()
    np.testing.assert_array_equal(taken, before)
    assert not np.array_equal(some.rule.weights, before)
