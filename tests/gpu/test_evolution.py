"""Ranking, breeding, rollout and measurement against the CPU engine, a step at a time."""

import numpy as np
import pytest

from bns.engine.evolution import Population, rank
from bns.engine.snn import predict
from bns.robots.base import RandomStream
from tests.gpu.arrays import KEY, SIZE, Arrays

ROBOTS = ["khepera", "snake"]


@pytest.mark.parametrize("robot", ROBOTS)
def test_scores_are_the_cpu_engines(robot):
    one = Arrays(robot)
    one.evolve(0)
    scores = one.robot.score(one.start, one.weights[0], one.task, RandomStream(KEY, 0))
    np.testing.assert_allclose(one.first(one.fitness), scores.fitness, rtol=1e-6)
    np.testing.assert_array_equal(one.first(one.reached), scores.goals_reached)
    np.testing.assert_array_equal(one.first(one.used), one.start.lengths if scores.used is None else scores.used)
    np.testing.assert_array_equal(one.first(one.order), rank(one.first(one.fitness)))
    assert one.failures.tolist() == [0]


def test_noise_is_that_of_the_generation():
    first, second = Arrays("snake", generations_per_evaluation=0), Arrays("snake", size=3, mutation_rate=0.0)
    first.evolve(0)
    second.evolve(0)
    second.evolve(1)
    elite = int(second.first(second.order)[0])
    assert elite in range(3)
    scores = second.robot.score(second.population(1), second.weights[0], second.task, RandomStream(KEY, 1))
    np.testing.assert_allclose(second.first(second.fitness), scores.fitness, rtol=1e-6)
    assert (first.first(first.fitness)[:3] != scores.fitness).any()


def test_failed_arithmetic_is_worth_nothing_comes_last_and_is_counted_after_the_first_time():
    one = Arrays("khepera", scale=1e7, generations_per_evaluation=0)
    one.evolve(0)
    scores = one.robot.score(one.start, one.weights[0], one.task)
    assert 0 < scores.failures <= SIZE
    np.testing.assert_array_equal(one.first(one.fitness) == 0, scores.fitness == 0)
    np.testing.assert_array_equal(one.first(one.order), rank(one.first(one.fitness)))
    assert one.failures.tolist() == [0]
    one.evolve(1)
    assert one.failures.tolist() == [scores.failures]


def test_a_snake_whose_numbers_are_lost_is_worth_nothing():
    one = Arrays("snake", size=2, longest=2, generations_per_evaluation=0)
    one.weights[0, 0, -1] = np.nan
    one.evolve(1)
    scores = one.robot.score(one.start, one.weights[0], one.task, RandomStream(KEY, 0))
    assert one.first(one.fitness).tolist() == scores.fitness.tolist() == [0, 0]
    assert one.failures.tolist() == [scores.failures] == [2]


def test_equals_keep_their_order():
    one = Arrays("khepera", scale=0.0, mutation_rate=0.0, share=0.0, generations_per_evaluation=0)
    one.commands[0, 0, :] = one.commands[0, 0, 0]
    one.lengths[0, 0, :] = one.lengths[0, 0, 0]
    one.evolve(0)
    assert one.first(one.order).tolist() == list(range(SIZE))


@pytest.mark.parametrize("size", [1, 2, 8, 9])
@pytest.mark.parametrize(("rate", "shortest", "longest"), [(0.0, 2, 6), (0.5, 4, 4), (1.0, 1, 5)])
def test_children_are_those_of_the_cpu_engine(size, rate, shortest, longest):
    assert_children("khepera", size, rate, shortest, longest)


@pytest.mark.slow
@pytest.mark.parametrize(("size", "rate"), [(1, 0.5), (2, 1.0), (5, 0.3)])
def test_children_of_snakes_are_those_of_the_cpu_engine(size, rate):
    assert_children("snake", size, rate, 1, 2)


def assert_children(robot, size, rate, shortest, longest):
    one = Arrays(robot, size, mutation_rate=rate, shortest=shortest, longest=longest)
    one.evolve(0)
    order = one.first(one.order).astype(np.int64)
    one.evolve(1)
    children = Population(np.zeros_like(one.start.commands), np.zeros_like(one.start.lengths))
    hits = one.robot.breed(KEY, one.start, order, one.first(one.cdf).copy(), rate, shortest, 1, children)
    np.testing.assert_array_equal(one.population(1).lengths, children.lengths)
    for i in range(size):
        np.testing.assert_allclose(one.population(1).controller(i), children.controller(i), rtol=1e-6)
    assert one.hits.tolist() == [hits]


def test_several_generations_in_one_launch_are_one_after_the_other():
    together, apart = Arrays("khepera", generations_per_evaluation=4), Arrays("khepera", generations_per_evaluation=2)
    together.evolve(0)
    together.evolve(1)
    for evaluation in range(3):
        apart.evolve(evaluation)
    # A population is scored once more where a launch begins, which changes nothing.
    np.testing.assert_array_equal(together.commands[0], apart.commands[0])
    np.testing.assert_array_equal(together.fitness, apart.fitness)


@pytest.mark.parametrize("robot", ROBOTS)
def test_what_is_measured_is_what_the_cpu_engine_measures(robot):
    one, draws = Arrays(robot, generations_per_evaluation=0), np.random.default_rng(2)
    one.evolve(0)
    one.X[:], one.targets[:] = draws.uniform(-1, 1, one.X.shape), draws.uniform(0, 1, one.targets.shape)
    one.targets[0, 0, 0, 1] = np.nan  # a network that does not learn from a pattern
    one.counts[0], one.failures[0], one.hits[0] = 3, 5, 6
    scores = one.robot.score(one.start, one.weights[0], one.task, RandomStream(KEY, 0))
    errors = predict(one.weights[0], one.X[0, 0, :, :3], one.robot.sigmoid_output) - one.targets[0, 0, :, :3]
    expected = {
        "diversity": one.robot.diversity(one.start, scores),
        "mean_fitness": scores.fitness.mean(),
        "best_fitness": scores.fitness.max(),
        "training_error": np.nanmean(errors.astype(np.float64) ** 2),
        "validation_error": np.nan,
        "training_patterns": 3,
        "validation_patterns": 0,
        "mean_commands": one.start.lengths.mean(),
        "generations": 0,
        "bound_hits": 6,
        "arithmetic_failures": 5,
    }
    assert one.measure() == pytest.approx(expected, rel=1e-5, nan_ok=True)
