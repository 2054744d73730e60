"""Ranking, breeding, rollout and measurement against the CPU engine, a step at a time."""

import numpy as np
import pytest

from bns.cuda.evolution import evolution_kernel
from bns.cuda.measuring import MEASURED, measuring_kernel
from bns.cuda.robots.khepera import scored
from bns.cuda.settings import SETTINGS
from bns.engine.evolution import Population, rank, tournament_cdf
from bns.engine.philox import Key
from bns.engine.snn import initial_weights, predict
from bns.robots import load_robot
from bns.tasks import load_task

ROBOT, KEY = load_robot("khepera"), Key(11, 4)
TASK = load_task("khepera", "circle")
SIZE, CAPACITY = 9, 6
KERNEL = evolution_kernel(scored, ROBOT.bounds, 3, 20)


class Arrays:
    """One run as the kernels take it, with room for two controllers more than it has."""

    def __init__(self, size=SIZE, share=0.4, generations=1, rate=0.5, shortest=2, longest=CAPACITY, scale=1.0):
        self.settings = np.zeros(1, SETTINGS)
        values = {
            "evaluations": 3, "generations": generations, "population": size, "shortest": shortest, "longest": longest,
            "goals": len(TASK.goals_m), "key0": KEY.words[0], "key1": KEY.words[1], "mutation_rate": rate,
        }  # fmt: skip
        for name, value in values.items():
            self.settings[name] = value
        self.start = ROBOT.initial_population(KEY, size, shortest, longest)
        self.commands = np.zeros((2, 1, size + 2, CAPACITY, 3), np.float32)
        self.commands[0, 0, :size, :longest] = self.start.commands
        self.lengths = np.zeros((2, 1, size + 2), np.int32)
        self.lengths[0, 0, :size] = self.start.lengths
        self.weights = scale * initial_weights(KEY, 3, 20)[None]
        self.fitness = np.zeros((1, size + 2))
        self.reached, self.order = np.zeros((1, size + 2), np.int32), np.full((1, size + 2), -1, np.int32)
        self.cdf = np.ones((1, size + 2))
        self.cdf[0, :size] = tournament_cdf(size, share)
        self.goals = np.zeros((1, len(TASK.goals_m) + 1, 2))
        self.goals[0, :-1] = TASK.goals_m
        self.failures, self.hits = np.zeros(1, np.int32), np.zeros(1, np.int32)

    def evolve(self, evaluation, threads=4):
        with np.errstate(all="ignore"):  # networks that have diverged are among the cases
            KERNEL[1, threads](
                evaluation, self.settings, self.weights, self.commands, self.lengths, self.fitness, self.reached,
                self.order, self.cdf, self.goals, self.failures, self.hits,
            )  # fmt: skip

    def population(self, half=0):
        n = int(self.settings["population"][0])
        return Population(self.commands[half, 0, :n].copy(), self.lengths[half, 0, :n].copy())


def test_scores_are_the_cpu_engines():
    one = Arrays()
    one.evolve(0)
    scores = ROBOT.score(one.start, one.weights[0], TASK)
    np.testing.assert_allclose(one.fitness[0, :SIZE], scores.fitness, rtol=1e-6)
    np.testing.assert_array_equal(one.reached[0, :SIZE], scores.goals_reached)
    np.testing.assert_array_equal(one.order[0, :SIZE], rank(one.fitness[0, :SIZE]))
    assert one.failures.tolist() == [0]


def test_failed_arithmetic_is_worth_nothing_comes_last_and_is_counted_after_the_first_time():
    one = Arrays(scale=np.float32(1e7), generations=0)
    one.evolve(0)
    scores = ROBOT.score(one.start, one.weights[0], TASK)
    assert 0 < scores.failures <= SIZE
    np.testing.assert_array_equal(one.fitness[0, :SIZE] == 0, scores.fitness == 0)
    np.testing.assert_array_equal(one.order[0, :SIZE], rank(one.fitness[0, :SIZE]))
    assert one.failures.tolist() == [0]
    one.evolve(1)
    assert one.failures.tolist() == [scores.failures]


def test_equals_keep_their_order():
    one = Arrays(scale=np.float32(0), rate=0.0, share=0.0, generations=0)
    one.commands[0, 0, :] = one.commands[0, 0, 0]
    one.lengths[0, 0, :] = one.lengths[0, 0, 0]
    one.evolve(0)
    assert one.order[0, :SIZE].tolist() == list(range(SIZE))


@pytest.mark.parametrize("size", [1, 2, 8, 9])
@pytest.mark.parametrize(("rate", "shortest", "longest"), [(0.0, 2, 6), (0.5, 4, 4), (1.0, 1, 5)])
def test_children_are_those_of_the_cpu_engine(size, rate, shortest, longest):
    one = Arrays(size, rate=rate, shortest=shortest, longest=longest)
    one.evolve(0)
    order = one.order[0, :size].astype(np.int64)
    one.evolve(1)
    children = Population(np.zeros_like(one.start.commands), np.zeros_like(one.start.lengths))
    hits = ROBOT.breed(KEY, one.start, order, one.cdf[0, :size].copy(), rate, shortest, 1, children)
    np.testing.assert_array_equal(one.population(1).lengths, children.lengths)
    for i in range(size):
        np.testing.assert_allclose(one.population(1).controller(i), children.controller(i), rtol=1e-6)
    assert one.hits.tolist() == [hits]


def test_several_generations_in_one_launch_are_one_after_the_other():
    together, apart = Arrays(generations=4), Arrays(generations=2)
    together.evolve(0)
    together.evolve(1)
    for evaluation in range(3):
        apart.evolve(evaluation)
    # A population is scored once more where a launch begins, which changes nothing.
    np.testing.assert_array_equal(together.commands[0], apart.commands[0])
    np.testing.assert_array_equal(together.fitness, apart.fitness)


def test_what_is_measured_is_what_the_cpu_engine_measures():
    one, draws = Arrays(), np.random.default_rng(2)
    one.evolve(0)
    one.settings["generations"] = 0
    X = draws.uniform(-1, 1, (2, 1, 5, 4)).astype(np.float32)
    targets, counts = draws.uniform(-1, 1, (2, 1, 3, 4)).astype(np.float32), np.array([[3], [0]], np.int32)
    one.failures[0], one.hits[0], rows = 5, 6, np.zeros((1, 1, len(MEASURED)))
    measuring_kernel(ROBOT.bounds, 3, 20)[1, 3](
        1, one.settings, one.weights.reshape(1, -1), one.commands, one.lengths, one.fitness, one.order, X, targets,
        counts, one.failures, one.hits, rows,
    )  # fmt: skip
    scores, errors = ROBOT.score(one.start, one.weights[0], TASK), predict(one.weights[0], X[0, 0, :, :3]) - targets[0, 0, :, :3]
    expected = {
        "diversity": ROBOT.diversity(one.start, scores),
        "mean_fitness": scores.fitness.mean(),
        "best_fitness": scores.fitness.max(),
        "training_error": np.mean(errors.astype(np.float64) ** 2),
        "validation_error": np.nan,
        "training_patterns": 3,
        "validation_patterns": 0,
        "mean_commands": one.start.lengths.mean(),
        "generations": 0,
        "bound_hits": 6,
        "arithmetic_failures": 5,
    }
    np.testing.assert_allclose(rows[0, 0], [expected[name] for name in MEASURED], rtol=1e-5)
