"""What every robot promises, on every one of its tasks. A new robot or task is found by itself."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from bns.engine.evolution import Population, rank, tournament_cdf
from bns.engine.philox import Key
from bns.engine.snn import initial_weights, predict
from bns.errors import SpecError
from bns.robots import load_robot, robot_names
from bns.robots.base import RandomStream, on_floor
from bns.spec import FIELDS
from bns.tasks import load_task, task_names

ROBOTS = robot_names()
GOALS = [(robot, task) for robot in ROBOTS for task in task_names(robot)]
KEY = Key(3, 1)


def some_displacements(robot):
    """Arrays (n, networks); truth values where a network predicts one."""
    reach = st.floats(-3, 3, allow_subnormal=False)
    kinds = [st.sampled_from([0.0, 1.0]) if name == "stable" else reach for name in robot.networks]
    return st.lists(st.tuples(*kinds), min_size=1, max_size=12).map(np.array)


def poses_at(robot, points):
    """Poses of the robot at these places (n, 2), looking east, everything well."""
    poses = np.repeat(robot.start_pose(), len(points), axis=0)
    moved = points - np.column_stack([robot.pose_columns(poses)[name] for name in ("x_m", "y_m")])
    for first in range(0, poses.shape[1] - 1, 2):
        poses[:, first : first + 2] += moved
    return poses


@pytest.fixture(params=ROBOTS)
def robot(request):
    return load_robot(request.param)


@pytest.fixture(params=GOALS, ids="-".join)
def goal(request):
    """A robot and one of its tasks."""
    return load_robot(request.param[0]), load_task(*request.param)


def weights_of(robot, seed=0, scale=0.5):
    return initial_weights(Key(seed, 1), len(robot.networks), robot.hidden, robot.input_count) * np.float32(scale)


def test_poses_move_as_one_body(robot):
    points = np.array([[0.2, -0.1], [0.5, 0.3], [-0.4, 0.0]])
    poses, shift = poses_at(robot, points), np.array([0.3, -0.2])
    moved = robot.transform(poses, 0.6, shift)
    before, after = on_floor(robot, poses), on_floor(robot, moved)
    assert after[:, 2] - before[:, 2] == pytest.approx(0.6)
    expected = before[:, :2] @ np.array([[np.cos(0.6), np.sin(0.6)], [-np.sin(0.6), np.cos(0.6)]]) + shift
    np.testing.assert_allclose(after[:, :2], expected, atol=1e-12)
    learned = robot.measured_displacements(poses)[1:]
    np.testing.assert_allclose(robot.measured_displacements(moved)[1:], learned, atol=1e-9)


def test_a_cycle_called_unstable_teaches_no_displacement(robot):
    poses = poses_at(robot, np.array([[0.2, -0.1], [0.5, 0.3], [-0.4, 0.0]]))
    marked = robot.marked_unstable(poses, (2,))
    learns = robot.learnable(robot.measured_displacements(marked))
    assert learns.all() if "stable" not in robot.networks else learns[0].tolist() == [True, False, True]
    np.testing.assert_array_equal(robot.marked_unstable(poses, ()), poses)


def test_defaults_name_a_robot_and_its_task():
    assert FIELDS["robot"].default in ROBOTS
    assert FIELDS["task"].default in task_names(FIELDS["robot"].default)


def test_unknown_names_list_the_known_ones():
    with pytest.raises(SpecError, match=r"unknown robot 'kheperra'.*Did you mean 'khepera'.*Valid: .*khepera"):
        load_robot("kheperra")
    with pytest.raises(SpecError, match=r"robot khepera: unknown task 'cirle'.*'circle'.*Valid: "):
        load_task("khepera", "cirle")


def test_names_and_shapes_fit_together(robot):
    assert load_robot(robot.name) is robot
    components = len(robot.bounds.low)
    assert len(robot.command_columns) == len(set(robot.command_columns)) == components
    assert len(set(robot.networks)) == len(robot.networks)
    assert list(robot.radii_m) == sorted(robot.radii_m)
    assert robot.bounds.high.shape == robot.bounds.mutation_span.shape == (components,)
    assert (robot.bounds.low < robot.bounds.high).all()
    assert (robot.bounds.mutation_span > 0).all()


def test_populations_are_of_their_key_and_within_bounds(robot):
    one, same, other = (robot.initial_population(Key(seed, 1), 30, 4, 50) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.commands, same.commands)
    np.testing.assert_array_equal(one.lengths, same.lengths)
    assert not np.array_equal(one.controller(0), other.controller(0))
    for i in range(30):
        assert (one.controller(i) >= robot.bounds.low).all()
        assert (one.controller(i) <= robot.bounds.high).all()


def test_random_controllers_are_apart_from_the_population(robot):
    probes = robot.random_controllers(KEY, 10, 5)
    assert probes.lengths.tolist() == [5] * 10
    assert (probes.commands >= robot.bounds.low).all()
    assert (probes.commands <= robot.bounds.high).all()
    assert not np.array_equal(probes.controller(0)[:4], robot.initial_population(KEY, 10, 4, 50).controller(0)[:4])


def test_inputs_stay_near_one_and_notice_every_component(robot):
    commands = robot.random_controllers(KEY, 1, 30).controller(0)
    X = robot.inputs(commands)
    assert X.dtype == np.float32
    assert X.shape[1] == 30
    assert np.abs(X).max() < 2
    for c in range(commands.shape[1]):
        changed = commands.copy()
        changed[7, c] = robot.bounds.low[c] + robot.bounds.high[c] - changed[7, c]
        different = (robot.inputs(changed) != X).any(axis=0)
        assert different[7] == (robot.command_columns[c] != "repeats")  # seen in how often a cycle is driven
        assert not different[:7].any()  # a command cannot change what came before it


def test_displacements_and_targets_are_inverse(robot):
    X = robot.inputs(robot.random_controllers(KEY, 1, 25).controller(0))
    outputs = predict(weights_of(robot), X, robot.sigmoid_output)
    np.testing.assert_allclose(robot.targets(robot.displacements(outputs)), outputs, rtol=1e-6)


@pytest.mark.parametrize("name", ROBOTS)
@settings(max_examples=100, deadline=None)
@given(data=st.data())
def test_poses_and_measured_displacements_are_inverse(name, data):
    robot = load_robot(name)
    displacements = data.draw(some_displacements(robot))
    poses = robot.poses(displacements)
    assert len(poses) == len(displacements)
    assume(np.isfinite(poses).all())  # markers on top of each other have no direction
    np.testing.assert_allclose(robot.measured_displacements(poses), displacements, rtol=0, atol=1e-8)
    np.testing.assert_allclose(robot.poses(robot.measured_displacements(poses)), poses, rtol=0, atol=1e-7)


def test_score_is_what_judge_says_of_the_simulated_path(goal):
    robot, task = goal
    weights, population = weights_of(robot), robot.initial_population(KEY, 100, 4, 60)
    scores = robot.score(population, weights, task)
    assert scores.fitness.shape == scores.goals_reached.shape == (100,)
    judged = []
    for i in range(100):
        planned = robot.plan(population.controller(i), weights, task)
        outputs = predict(weights, robot.inputs(planned), robot.sigmoid_output)
        judged.append(robot.evaluate_path(robot.poses(robot.displacements(outputs)), task))
    # The same float32 outputs but for the order of sums at the end of a vector loop.
    np.testing.assert_allclose(scores.fitness, [fitness for fitness, _ in judged], rtol=1e-5)
    assert scores.goals_reached.tolist() == [reached for _, reached in judged]
    assert len(np.unique(scores.fitness)) > 90


def test_a_score_does_not_depend_on_the_neighbours(goal):
    robot, task = goal
    weights, population = weights_of(robot), robot.initial_population(KEY, 40, 4, 60)
    together = robot.score(population, weights, task)
    back = Population(population.commands[::-1].copy(), population.lengths[::-1].copy())
    np.testing.assert_allclose(robot.score(back, weights, task).fitness[::-1], together.fitness, rtol=1e-5)
    noisy = Population(population.commands.copy(), population.lengths)
    for i, length in enumerate(noisy.lengths):
        noisy.commands[i, length:] = np.nan
    np.testing.assert_array_equal(robot.score(noisy, weights, task).fitness, together.fitness)


@pytest.mark.parametrize("rate", [0.0, 0.1, 1.0])
def test_what_is_taken_over_from_the_parents_is_what_would_be_computed(goal, rate):
    robot, task = goal
    weights, population = weights_of(robot), robot.initial_population(KEY, 60, 4, 12)
    scores, cdf = robot.score(population, weights, task, RandomStream(KEY, 0)), tournament_cdf(60, 0.1)
    for generation in range(1, 8):
        children = Population(np.zeros_like(population.commands), population.lengths.copy())
        robot.breed(KEY, population, rank(scores.fitness), cdf, rate, 4, generation, children)
        stream = RandomStream(KEY, generation)
        anew, scores = robot.score(children, weights, task, stream), robot.score(children, weights, task, stream, scores)
        for computed, taken in zip(anew, scores, strict=True):
            np.testing.assert_array_equal(computed, taken)
        population = children


def test_fitness_is_positive_finite_and_better_for_a_drive_through_the_goals(goal):
    robot, task = goal
    through = poses_at(robot, task.goals_m)
    fitness, reached = robot.evaluate_path(through, task)
    assert reached == len(task.goals_m)
    assert robot.succeeded(through, task)
    assert not robot.succeeded(through[:-1], task)
    assert robot.successes(through, task) == (True,) * len(robot.radii_m)
    backwards, fewer = robot.evaluate_path(through[::-1], task)
    assert 0 < backwards < fitness < np.inf
    assert fewer < reached


def test_a_path_that_is_not_finite_is_worth_nothing(goal):
    robot, task = goal
    for bad in (np.nan, np.inf):
        path = poses_at(robot, np.zeros((4, 2)))
        path[2, :8] = bad
        assert robot.evaluate_path(path, task)[0] == 0
        assert not robot.succeeded(path, task)
        assert not any(robot.successes(path, task))


def test_success_is_monotone_in_the_radius(goal):
    robot, task = goal
    random, seen = np.random.default_rng(0), set()
    spread = np.abs(task.goals_m).max()
    for _ in range(200):
        noise = random.normal(0, 0.4 * spread * random.random(), task.goals_m.shape)
        within = robot.successes(poses_at(robot, task.goals_m + noise), task)
        assert list(within) == sorted(within)
        assert robot.succeeded(poses_at(robot, task.goals_m + noise), task) == within[0] if within else True
        seen.add(within)
    assert len(seen) >= len(robot.radii_m)  # from none to all


def test_networks_that_failed_are_counted_controller_by_controller(goal):
    robot, task = goal
    weights = np.full_like(weights_of(robot), np.nan)
    scores = robot.score(robot.initial_population(KEY, 10, 4, 50), weights, task)
    assert scores.failures == 10
    assert scores.fitness.tolist() == [0] * 10


def test_driving_takes_time(robot):
    commands = robot.random_controllers(KEY, 1, 6).controller(0)
    assert 0 < robot.driven_ms(commands[:3]) < robot.driven_ms(commands)
