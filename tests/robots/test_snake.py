"""The snake: algorithm 3 by hand, the compiled rollouts against it, operators that keep to the rules."""

import math

import numpy as np
import pytest

from bns.engine.evolution import Population, rank, tournament_cdf
from bns.engine.philox import Key, Purpose, normals
from bns.engine.snn import initial_weights, predict
from bns.errors import SpecError
from bns.robots import load_robot
from bns.robots.base import RandomStream, Scores
from bns.robots.snake import cycles, path
from bns.robots.snake.robot import NOISE_SD_M, NOISY_EVALUATIONS
from bns.tasks import default_task, load_task, task_of

ROBOT, KEY = load_robot("snake"), Key(4, 2)
TWO, THREE = load_task("snake", "two-regions"), load_task("snake", "three-regions")


def seen_at(points, stable=1.0):
    """Observations of a robot that lies east to west with its middle at these points."""
    ends = np.hstack([np.add(points, [-0.325, 0]), np.add(points, [0.325, 0])])
    return np.column_stack([np.vstack([np.ravel(path.START_M), ends[:-1]]), ends, np.full(len(ends), stable)])


def networks(seed=0):
    """Untrained networks whose displacements are spread about 0 as real ones are, of both markers alike."""
    weights = initial_weights(Key(seed, 1), 5, 100, 4)
    weights[2:4] = weights[:2]
    X = ROBOT.inputs(ROBOT.random_controllers(KEY, 1, 500).controller(0))
    weights[:, -1] -= predict(weights, X).mean(axis=1)
    return weights


def test_default_task_is_the_first_of_the_source():
    assert (default_task("snake"), default_task("khepera")) == ("two-regions", "circle")


def test_fitness_of_a_path_worked_out_by_hand():
    # Reaches the first region, ends 0.5 m below the second's middle, one position outside the surface.
    points = [[0.2, 0.2], [0.3, -0.95], [0.3, -0.8]]
    fitness, reached, used = path.evaluate_path(seen_at(points), TWO)
    assert (reached, used) == (1, 3)
    assert fitness == pytest.approx(1 / (path.PENALTY_M + 0.5))
    # Never gets anywhere: its distance to the first goal, and a penalty for each goal after that one.
    assert path.evaluate_path(seen_at([[0.3, 0.0]]), THREE)[0] == pytest.approx(1 / (0.3 + 2 * path.PENALTY_M))


def test_a_region_is_a_square_with_its_edge():
    for x, y, inside in ((0.5, 0.1, True), (0.11, 0.49, True), (0.51, 0.3, False), (0.3, 0.09, False)):
        assert path.evaluate_path(seen_at([[x, y]]), TWO)[1] == inside


def test_success_is_worth_most_and_what_comes_after_it_does_not_count():
    points = [[0.3, 0.3], [0.3, -0.3], [5.0, 5.0]]
    fitness, reached, used = path.evaluate_path(seen_at(points), TWO)
    assert (fitness, reached, used) == (1 / path.SMALLEST_SUM_M, 2, 2)


def test_unstable_cycles_cost_a_penalty_each_but_for_the_last_one_of_a_success():
    wavering = seen_at([[0.3, 0.3], [0.3, -0.3]])
    wavering[0, 8] = 0
    assert path.evaluate_path(wavering, TWO)[0] == pytest.approx(1 / path.PENALTY_M)
    wavering[:, 8] = [1, 0]  # as printed, the walk breaks off before the check
    assert path.evaluate_path(wavering, TWO)[0] == pytest.approx(1 / path.SMALLEST_SUM_M)


def test_frames_have_y_from_yellow_to_green_and_x_to_its_right():
    # Facing east, to the right is south.
    seen = path.walk(np.array([[0.1, 0.02, 0.1, 0.02, 1.0]]))
    np.testing.assert_allclose(seen[0, 4:8], [-0.005, -0.1, 0.645, -0.1])
    turned = path.walk(np.array([[0.0, 0, 0.65, 0, 1.0], [0.1, 0, 0.1, 0, 1.0]]))
    along = np.array([1, -1]) / math.sqrt(2)
    np.testing.assert_allclose(turned[1, 4:6] - turned[0, 4:6], 0.1 * np.array([along[1], -along[0]]), atol=1e-12)


def noisy_twin(controller, weights, task, rows):
    """Mean fitness of one controller over rows of noise, cycle by cycle in Python."""
    in_full = cycles.in_full(controller)
    moved = ROBOT.displacements(predict(weights, ROBOT.inputs(in_full), True))
    worth = []
    for row in rows:
        noisy = moved.copy()
        noisy[:, :4] += row[: len(moved)]
        worth.append(path.evaluate_path(path.walk(noisy), task)[0])
    return np.mean(worth)


@pytest.mark.parametrize("task", [TWO, THREE], ids=lambda task: task.name)
def test_noisy_rollouts_are_their_twins(task):
    weights, population = networks(), ROBOT.initial_population(KEY, 40, 4, 100)
    scores = ROBOT.score(population, weights, task, RandomStream(KEY, 3))
    rows = normals(KEY, Purpose.ROLLOUT_NOISE, 3, NOISY_EVALUATIONS, 40) * NOISE_SD_M
    twins = [noisy_twin(population.controller(i), weights, task, rows) for i in range(40)]
    np.testing.assert_allclose(scores.fitness, twins, rtol=1e-4)
    assert len(np.unique(scores.goals_reached)) > 1
    other = ROBOT.score(population, weights, task, RandomStream(KEY, 4))
    assert (other.fitness != scores.fitness).mean() > 0.9
    np.testing.assert_array_equal(other.goals_reached, scores.goals_reached)  # counted without noise


def test_plan_drives_what_simulation_needs_and_no_more():
    weights, population = networks(), ROBOT.initial_population(KEY, 200, 4, 100)
    scores = ROBOT.score(population, weights, TWO)
    done = np.flatnonzero(scores.goals_reached == 2)
    assert len(done) > 0
    for i in done[:5]:
        controller = population.controller(i)
        planned = ROBOT.plan(controller, weights, TWO)
        assert len(planned) < controller[:, 4].sum() or scores.used[i] == 10
        np.testing.assert_array_equal(planned[-1], controller[scores.used[i] - 1])
    undone = int(np.flatnonzero(scores.goals_reached < 2)[0])
    whole = ROBOT.plan(population.controller(undone), weights, TWO)
    assert len(whole) == population.controller(undone)[:, 4].sum()


def bred(rate, generation=1, n=200):
    parents = ROBOT.initial_population(KEY, n, 4, 100)
    children = Population(np.zeros_like(parents.commands), np.zeros_like(parents.lengths))
    fitness = np.random.default_rng(0).random(n)
    order, cdf = rank(fitness), tournament_cdf(n, 0.05)
    assert ROBOT.breed(KEY, parents, order, cdf, rate, 4, generation, children) == 0
    return parents, children, int(order[0])


@pytest.mark.parametrize("rate", [0.0, 0.1, 1.0])
def test_children_keep_to_the_bounds_and_the_best_goes_on(rate):
    parents, children, best = bred(rate)
    np.testing.assert_array_equal(children.commands[0], parents.commands[best])
    assert (children.commands >= ROBOT.bounds.low).all()
    assert (children.commands <= ROBOT.bounds.high).all()
    lateral, vertical, repeats = children.commands[..., 0], children.commands[..., 1], children.commands[..., 4]
    assert ((vertical < lateral) | (lateral == 0)).all()
    assert set(np.unique(repeats)) == {1, 2, 3, 4}
    assert children.lengths.tolist() == [10] * 200


def test_without_mutation_components_come_half_and_half_from_two_parents():
    parents, children, _ = bred(0.0)
    omega = parents.commands[..., 2]
    shares = []
    for child in children.commands[1:, :, 2]:
        from_parent = (child == omega).mean(axis=1)
        two = np.sort(from_parent)[-2:]
        assert two.sum() >= 1 - 1e-9  # every component is one of two parents'
        shares.append(two[0] if two[1] < 1 else np.nan)
    assert 0.3 < np.nanmean(shares) < 0.5  # the smaller of two shares that are a half on average


def test_mutation_moves_a_share_of_the_components_by_no_more_than_their_span():
    still, moved = bred(0.0)[1], bred(0.3)[1]
    apart = moved.commands[1:] - still.commands[1:]
    angle = np.abs(np.mod(apart[..., 2:4] + math.pi, 2 * math.pi) - math.pi)
    assert angle.max() <= 0.2 + 1e-5
    assert (angle > 0).mean() == pytest.approx(0.3, abs=0.03)
    assert np.abs(apart[..., 0]).max() <= math.radians(20) + 1e-5
    assert np.mean(apart[..., 4] != 0) == pytest.approx(0.3 * 0.75, abs=0.03)
    np.testing.assert_array_equal(bred(0.3)[1].commands, moved.commands)
    assert not np.array_equal(bred(0.3, generation=2)[1].commands, moved.commands)


def test_diversity_counts_the_cycles_that_are_needed():
    population = ROBOT.initial_population(KEY, 50, 4, 100)
    used = np.full(50, 10, np.int32)
    scores = Scores(np.ones(50), used, 0, used)
    whole = ROBOT.diversity(population, scores)
    assert ROBOT.diversity(population, scores._replace(used=used // 5)) == pytest.approx(whole / 5, rel=0.2)
    alike = Population(np.repeat(population.commands[:1], 50, axis=0), population.lengths)
    assert ROBOT.diversity(alike, scores) == pytest.approx(0, abs=1e-5)


def test_networks_learn_displacements_from_stable_cycles_only():
    learnable = ROBOT.learnable(np.array([[0.1, 0, 0.1, 0, 1.0], [0.5, 0, 0.1, 0, 0.0]]))
    np.testing.assert_array_equal(learnable, [[True, False]] * 4 + [[True, True]])


def test_a_goal_outside_the_surface_is_refused():
    content = {"title": "t", "source": "s", "goals_m": [[0.3, 0.3], [1.2, 0.3]], "region_m": 0.4, "surface_m": [2.7, 1.85]}
    with pytest.raises(SpecError, match=r"goal at \(1.2, 0.3\) m, 0.4 m wide, reaches outside the surface of 2.7 m by 1.85 m"):
        task_of("far", content)
    content["goals_m"] = [[0.3, 0.3], [1.15, 0.3]]
    assert task_of("near", content).goals_m.shape == (2, 2)
