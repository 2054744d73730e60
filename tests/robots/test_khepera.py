"""The Khepera's fitness by hand and against a slow twin; success; devices and bounds."""

import math

import numpy as np
import pytest

from bns.engine import reference
from bns.engine.evolution import Population
from bns.engine.philox import Key
from bns.engine.snn import initial_weights, weight_count
from bns.robots.khepera import GOAL_RADIUS_M, LARGEST_HEADING_RAD, MISSED_GOAL_M, ROBOT, SMALLEST_SUM_M
from bns.tasks import Task, load_task

CIRCLE = load_task("khepera", "circle")


def task(*goals):
    return Task("t", "t", "made up", np.array(goals, np.float64))


def constant(right=0.0, ahead=0.0, turn=0.0):
    """Networks whose every command does the same, metres and radians."""
    weights = np.zeros((3, weight_count(20)), np.float32)
    weights[:, -1] = ROBOT.targets(np.array([[right, ahead, turn]]))[:, 0]
    return weights


def lists(*lengths, seed=0):
    """Controllers of random commands."""
    some = ROBOT.random_controllers(Key(seed, 1), len(lengths), max(lengths))
    return Population(some.commands, np.array(lengths, np.int32))


def fitness_of(weights, length, aim):
    scores = ROBOT.score(lists(length), weights, aim)
    return scores.fitness[0], scores.goals_reached[0]


def algorithm_2(commands, weights, goals):
    """The slow twin: network outputs from the reference, poses by complex numbers, goals in order."""
    right, ahead, turn = ROBOT.displacements(reference.predict(weights, ROBOT.inputs(commands))).T
    position, heading, todo, total = 0j, math.pi / 2, list(goals), 0.0
    for r, a, t in zip(right, ahead, turn, strict=True):
        position += complex(a, -r) * complex(math.cos(heading), math.sin(heading))
        heading += t
        if todo and abs(position - complex(*todo[0])) <= GOAL_RADIUS_M:
            todo.pop(0)
        total += abs(position - complex(*(todo or goals[-1:])[0]))
    total += MISSED_GOAL_M * len(todo)
    return 1 / max(total, SMALLEST_SUM_M), len(goals) - len(todo)


@pytest.mark.parametrize("name", ["circle", "infinity", "complex"])
def test_score_is_algorithm_2(name):
    aim, weights = load_task("khepera", name), initial_weights(Key(3, 1), 3, 20) * np.float32(0.5)
    some = ROBOT.initial_population(Key(1, 1), 200, 4, 40)
    scores = ROBOT.score(some, weights, aim)
    slow = [algorithm_2(some.controller(i), weights, aim.goals_m.tolist()) for i in range(len(some))]
    # Outputs good to 5e-6, thirteen of them and the arm of a turn: a sum of distances good to about 1e-3 in 10 or more.
    np.testing.assert_allclose(scores.fitness, [f for f, _ in slow], rtol=1e-4)
    assert scores.goals_reached.tolist() == [reached for _, reached in slow]
    assert scores.failures == 0


def test_only_commands_that_are_new_are_computed():
    """What is said to be known is believed, and of commands that changed nothing is known."""
    weights, some = initial_weights(Key(3, 1), 3, 20), lists(6, 6, 6)
    known = ROBOT.score(some, weights, CIRCLE)
    child = Population(some.commands.copy(), some.lengths.copy())
    child.origin[0, :6], child.origin[1, :6] = np.arange(6), [6, 7, 8, 9, 10, 999]
    lost = known._replace(outputs=np.full_like(known.outputs, np.nan))
    scores = ROBOT.score(child, weights, CIRCLE, None, lost)
    assert np.isnan(scores.outputs[:, :11]).all()
    np.testing.assert_array_equal(scores.outputs[:, 11:], known.outputs[:, 11:])
    assert scores.failures == 2


def test_one_goal_by_hand():
    # 10 cm north a command; the goal is 25 cm north: 15 and 5 cm off, the second within 7 cm, the third 5 cm beyond.
    aim = task([0, 0.25])
    assert fitness_of(constant(ahead=0.1), 1, aim) == (pytest.approx(1 / (0.15 + 10)), 0)
    assert fitness_of(constant(ahead=0.1), 2, aim) == (pytest.approx(1 / (0.15 + 0.05), rel=1e-5), 1)
    assert fitness_of(constant(ahead=0.1), 3, aim) == (pytest.approx(1 / (0.15 + 0.05 + 0.05), rel=1e-5), 1)


def test_a_goal_reached_hands_over_to_the_next_within_the_command():
    # At 10 cm the first goal is reached, and the distance that counts is the one to the second already.
    aim = task([0, 0.1], [0, 0.4])
    assert fitness_of(constant(ahead=0.1), 1, aim) == (pytest.approx(1 / (0.3 + 10), rel=1e-6), 1)
    assert fitness_of(constant(ahead=0.1), 4, aim) == (pytest.approx(1 / (0.3 + 0.2 + 0.1), rel=1e-5), 2)


def test_one_command_reaches_one_goal_at_most():
    # At 40 cm the first goal is reached; the second, 3 cm off, is reached by the next command, 37 cm away by then: no.
    assert fitness_of(constant(ahead=0.4), 2, task([0, 0.4], [0, 0.43]))[1] == 1
    assert fitness_of(constant(ahead=0.02), 20, task([0, 0.4], [0, 0.43]))[1] == 2


def test_goals_count_in_their_order_only():
    assert fitness_of(constant(ahead=0.1), 4, task([0, 0.1], [0, 0.4]))[1] == 2
    assert fitness_of(constant(ahead=0.1), 4, task([0, 0.4], [0, 0.1]))[1] == 1


def test_right_is_east_at_the_start_and_a_turn_is_counterclockwise():
    assert fitness_of(constant(right=0.1), 3, task([0.3, 0]))[1] == 1
    # North 20 cm, then a quarter turn to the left: west.
    corners = task([0, 0.2], [-0.2, 0.2], [-0.2, 0], [0, 0])
    assert fitness_of(constant(ahead=0.2, turn=math.pi / 2), 4, corners)[1] == 4
    assert fitness_of(constant(ahead=0.2, turn=-math.pi / 2), 4, corners)[1] == 1


def test_fitness_is_bounded_where_everything_is_on_the_goal():
    assert fitness_of(constant(), 1, task([0, 0])) == (pytest.approx(1 / SMALLEST_SUM_M), 1)


def test_one_goal_more_outweighs_any_shorter_path():
    # 8 cm from the first goal and nothing else, against the first reached and 8.9 m to go to the second.
    aim = task([0, 0.16], [0, 9])
    near, far = fitness_of(constant(ahead=0.08), 1, aim), fitness_of(constant(ahead=0.1), 1, aim)
    assert near == (pytest.approx(1 / 20.08), 0)
    assert far == (pytest.approx(1 / 18.9), 1)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("network", [0, 1, 2])
def test_failed_arithmetic_is_the_worst_and_is_counted(value, network):
    weights = initial_weights(Key(0, 1), 3, 20)
    weights[network, -1] = value
    scores = ROBOT.score(lists(2, 5, 13), weights, CIRCLE)
    assert scores.failures == 3
    assert scores.fitness.tolist() == [0, 0, 0]


def test_enormous_displacements_are_worth_next_to_nothing():
    scores = ROBOT.score(lists(2, 5, 13), constant(right=1e37, ahead=-1e37), CIRCLE)
    assert scores.failures == 0
    assert ((scores.fitness > 0) & (scores.fitness < 1e-36)).all()


def test_a_heading_beyond_bounds_is_failed_arithmetic():
    turn = LARGEST_HEADING_RAD * 0.6
    scores = ROBOT.score(lists(2, 3), constant(ahead=0.1, turn=turn), CIRCLE)
    assert (scores.failures, scores.fitness[1]) == (1, 0)
    assert scores.fitness[0] > 0
    for commands, fitness in zip((2, 3), scores.fitness, strict=True):
        poses = ROBOT.poses(np.tile([0.0, 0.1, turn], (commands, 1)))
        assert ROBOT.evaluate_path(poses, CIRCLE)[0] == pytest.approx(fitness, rel=1e-9)


@pytest.mark.parametrize("turn", [0.001, 1.0, 2.9, -1.7, 3000.0, -3000.0])
def test_directions_are_sine_and_cosine_whatever_the_heading(turn):
    some, weights = lists(12), constant(ahead=0.05, turn=turn)
    poses = ROBOT.poses(ROBOT.displacements(np.tile(weights[:, -1:], 12)))
    by_judge = ROBOT.evaluate_path(poses, CIRCLE)
    assert ROBOT.score(some, weights, CIRCLE).fitness[0] == pytest.approx(by_judge[0], rel=1e-9)


def test_inputs_are_normalised_and_remember_the_previous_command():
    commands = np.array([[3000, 30000, 400], [16500, 3000, 3000], [30000, 16500, 1700]], np.float32)
    standing = -16500 / 13500
    expected = [[standing, -1, 0], [standing, 1, -1], [-1, 0, 1], [1, -1, 0], [-1, 1, 0]]
    np.testing.assert_allclose(ROBOT.inputs(commands), expected, atol=1e-6)


def test_wheel_speeds_and_durations_in_si():
    left, right, duration = ROBOT.wheel_speeds_m_s(np.array([[14401.0, 28802.0, 2500.0]]))
    assert (left[0], right[0], duration[0]) == (pytest.approx(0.1), pytest.approx(0.2), 2.5)
    assert ROBOT.driven_ms(np.array([[1, 1, 400.0], [1, 1, 650.0]])) == 1050


def test_commands_typed_in_si_become_the_firmwares():
    """0.1 m/s is 14,401 steps of the firmware's, a second a thousand milliseconds; backwards is negative."""
    typed = ROBOT.parse_commands(np.array([[0.1, -0.2, 2.5], [0.0, 0.1, 0.4]]))
    np.testing.assert_allclose(typed, [[14401.0, -28802.0, 2500.0], [0.0, 14401.0, 400.0]], rtol=1e-12)


def test_success_by_radius():
    # Passes 6, 9, 13 and 19 cm from the only goal.
    for distance, expected in ((0.06, 4), (0.09, 3), (0.13, 2), (0.19, 1), (0.21, 0)):
        within = ROBOT.successes(np.array([[distance, 0.2, 0.0]]), task([0, 0.2]))
        assert within == (False,) * (4 - expected) + (True,) * expected
    assert ROBOT.successes(np.empty((0, 3)), task([0, 0.2])) == (False,) * 4


def test_success_and_goals_reached_agree_on_the_goal_radius():
    random, agreed = np.random.default_rng(0), 0
    for _ in range(300):
        poses = np.column_stack([random.uniform(-0.25, 0.25, (60, 2)), np.zeros(60)])
        all_reached = ROBOT.evaluate_path(poses, CIRCLE)[1] == 4
        assert ROBOT.successes(poses, CIRCLE)[0] == all_reached
        agreed += all_reached
    assert 5 < agreed < 295


@pytest.mark.parametrize("away", [0.07, 0.10, 0.14, 0.20])
def test_a_goal_is_reached_on_its_radius_and_not_beyond(away):
    at, beyond = (np.array([[x, 0.0, 0.0]]) for x in (away, np.nextafter(away, 1.0)))
    place = ROBOT.radii_m.index(away)
    assert ROBOT.successes(at, task([0.0, 0.0]))[place]
    assert not ROBOT.successes(beyond, task([0.0, 0.0]))[place]
