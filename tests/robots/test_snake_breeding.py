"""Breeding of the snake against a twin of whole arrays, bit for bit."""

import numpy as np
import pytest

from bns.engine.evolution import Population, rank, tournament_cdf
from bns.engine.philox import Key, Purpose, uniforms
from bns.engine.snn import initial_weights
from bns.engine.uniform import component_draws
from bns.robots import load_robot
from bns.robots.base import RandomStream
from bns.robots.snake.rules import BOUNDS, LARGEST_RATIO, MOST_REPEATS, REPEATS, TURN_RAD
from bns.tasks import load_task

ROBOT, KEY = load_robot("snake"), Key(4, 2)


def twin(commands, order, cdf, rate, generation):
    pairs = len(commands) // 2
    draws = uniforms(KEY, Purpose.PARENTS, generation, pairs, 1)[:, 0, :2]
    parents = order[np.minimum(np.searchsorted(cdf, draws, side="right"), len(order) - 1)]
    first, second = commands[parents[:, 0]], commands[parents[:, 1]]
    own = component_draws(KEY, Purpose.CUTS, generation, (pairs, *commands.shape[1:])) < ROBOT.parent_share
    both = np.stack([np.where(own, first, second), np.where(own, second, first)], axis=1).reshape(-1, *commands.shape[1:])
    children = np.concatenate([commands[order[:1]], both])[: len(commands)]
    u = component_draws(KEY, Purpose.MUTATION, generation, children.shape)
    mutates, moves = u < rate, 2.0 * u / max(rate, 1e-300) - 1.0
    return np.concatenate([children[:1], allowed(mutated(children, mutates, moves))[1:]])


def mutated(commands, mutates, moves):
    moved = commands + np.where(mutates, moves * BOUNDS.mutation_span, 0).astype(np.float32)
    moved[..., REPEATS] = 1 + np.floor(np.where(mutates, (moves[..., :] + 1) / 2, 0)[..., REPEATS] * MOST_REPEATS)
    return np.where(mutates, moved, commands)


def allowed(commands):
    commands[..., 2:4] = np.mod(commands[..., 2:4], np.float32(TURN_RAD))
    np.clip(commands, BOUNDS.low, BOUNDS.high, out=commands)
    commands[..., 1] = np.minimum(commands[..., 1], np.float32(LARGEST_RATIO) * commands[..., 0])
    return commands


@pytest.mark.parametrize("n", [2, 7, 100])
@pytest.mark.parametrize("rate", [0.0, 0.1, 1.0])
def test_children_are_those_of_the_twin(n, rate):
    parents = ROBOT.initial_population(KEY, n, 4, 100)
    order, cdf = rank(np.random.default_rng(0).random(n)), tournament_cdf(n, 0.05)
    for generation in range(1, 5):
        children = Population(np.zeros_like(parents.commands), np.zeros_like(parents.lengths))
        ROBOT.breed(KEY, parents, order, cdf, rate, 4, generation, children)
        np.testing.assert_array_equal(children.commands, twin(parents.commands, order, cdf, rate, generation))
        parents = children


@pytest.mark.parametrize("rate", [0.0, 0.1, 1.0])
def test_a_child_is_scored_as_anew_whatever_is_known_of_its_parents(rate):
    parents, weights = ROBOT.initial_population(KEY, 51, 4, 100), initial_weights(KEY, 5, ROBOT.hidden, ROBOT.input_count)
    task, scores = load_task("snake", "two-regions"), ROBOT.score(parents, weights, load_task("snake", "two-regions"))
    order, cdf = rank(scores.fitness), tournament_cdf(51, 0.1)
    for generation in range(1, 5):
        children = Population(np.zeros_like(parents.commands), np.zeros_like(parents.lengths))
        ROBOT.breed(KEY, parents, order, cdf, rate, 4, generation, children)
        known = children.origin >= 0
        before = parents.commands.reshape(-1, 5)[children.origin[known]]
        np.testing.assert_array_equal(children.commands[known][:, :REPEATS], before[:, :REPEATS])
        assert known[0].all()
        assert known[1:].mean() < (0.5 if rate == 1 else 1)
        stream = RandomStream(KEY, generation)
        found, anew = ROBOT.score(children, weights, task, stream, scores), ROBOT.score(children, weights, task, stream)
        np.testing.assert_array_equal(found.outputs, anew.outputs)
        np.testing.assert_array_equal(found.fitness, anew.fitness)
        parents, scores = children, found


def test_what_is_near_is_a_mutation_of_everything():
    commands = ROBOT.random_controllers(KEY, 1, 50).controller(0)
    moves = 2 * component_draws(KEY, Purpose.PROBE, 3, (1, 50, 5))[0] - 1
    wanted = allowed(mutated(commands, np.ones(commands.shape, bool), moves))
    np.testing.assert_array_equal(ROBOT.perturb(commands, KEY, 3), wanted)


def test_one_alone_goes_on_as_it_is():
    one = ROBOT.initial_population(KEY, 1, 4, 100)
    children = Population(np.zeros_like(one.commands), np.zeros_like(one.lengths))
    ROBOT.breed(KEY, one, np.arange(1), tournament_cdf(1, 0.5), 1.0, 4, 1, children)
    np.testing.assert_array_equal(children.commands, one.commands)
