"""Other readings of the source, switched on by the snake's name: each does what it says, and nothing else changes."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bns.bootstrap.trainer import Trainer, untrained
from bns.engine.evolution import Population, rank, tournament_cdf
from bns.engine.philox import Key, Purpose, normals
from bns.engine.snn import INPUTS, PER_NEURON, predict
from bns.physics.snake_drive import build as build_physics
from bns.robots import load_robot
from bns.robots.base import RandomStream
from bns.robots.snake import cycles, path
from bns.robots.snake.options import BEYOND, READINGS
from bns.robots.snake.rules import NOISE_SD_M, NOISY_EVALUATIONS
from bns.spec import RunSpec
from bns.static_simulator.train_in_stages import evolving
from bns.tasks import Task, load_task
from bns.worlds.substitute import build
from tests.robots.test_snake import networks

KEY, TASK, PLAIN = Key(4, 2), load_task("snake", "two-regions"), load_robot("snake")


def test_every_reading_can_be_named_and_all_together():
    for name in BEYOND + READINGS:
        assert load_robot(f"snake+{name}").switched_on == (name,)
    assert load_robot("+".join(["snake", *PLAIN.options])).switched_on == PLAIN.options


def test_lateral_amplitudes_are_uniform_and_those_of_the_other_reading_are_seldom_small():
    both = PLAIN, load_robot("snake+sorted-amplitudes")
    plain, other = (robot.random_controllers(KEY, 1, 4000).controller(0) for robot in both)
    for drawn in (plain, other):
        assert (drawn[:, 1] < drawn[:, 0]).all()
    assert np.mean(plain[:, 0] < 0.2) == pytest.approx(0.2 / (math.pi / 2), abs=0.02)
    assert np.mean(other[:, 0] < 0.2) == pytest.approx((0.2 / (math.pi / 2)) ** 2, abs=0.01)
    assert np.mean(plain[:, 1] < plain[:, 0] / 2) == pytest.approx(0.5, abs=0.03)
    np.testing.assert_array_equal(plain[:, 2:], other[:, 2:])


def test_a_drive_has_as_many_cycles_as_any_noisy_path_needs():
    weights, population, stream = networks(), PLAIN.initial_population(KEY, 60, 4, 100), RandomStream(KEY, 3)
    rows = normals(KEY, Purpose.ROLLOUT_NOISE, 3, NOISY_EVALUATIONS, 40) * NOISE_SD_M
    off, longer, never = load_robot("snake+cut-without-noise"), 0, 0
    for i in range(60):
        controller = population.controller(i)
        in_full = cycles.in_full(controller)
        moved = PLAIN.displacements(predict(weights, PLAIN.inputs(in_full), True))
        paths = [path.evaluate_path(path.walk(moved + np.pad(row[: len(moved)], ((0, 0), (0, 1)))), TASK) for row in rows]
        done = [used for _, goals, used in paths if goals == 2]
        used = max(done) if done else len(in_full)
        planned, without = PLAIN.plan(controller, weights, TASK, stream), off.plan(controller, weights, TASK, stream)
        np.testing.assert_array_equal(planned, in_full[:used])
        np.testing.assert_array_equal(without, PLAIN.plan(controller, weights, TASK))
        longer += len(planned) > len(without)
        never += not done
    assert longer > 0
    assert never > 0


def test_yellow_on_the_origin_moves_the_start_in_every_world():
    other = load_robot("snake+yellow-on-origin")
    np.testing.assert_allclose(other.start_pose()[0, :4], [0, 0, 0.65, 0])
    np.testing.assert_allclose(PLAIN.start_pose()[0, :4], [-0.025, 0, 0.625, 0])
    still = np.array([[0, 0, 1, 1, 1]], np.float32)
    for world in (build_physics(other), build(other)):
        begun = world.drive(still, KEY, Purpose.PROBE, 1)[0, :4]
        np.testing.assert_allclose(begun, [0, 0, 0.65, 0], atol=0.02)
    assert build_physics(other).digest != build_physics(PLAIN).digest


def test_yellow_on_the_origin_is_judged_in_rollouts_as_in_worlds():
    other, weights = load_robot("snake+yellow-on-origin"), networks()
    population = other.initial_population(KEY, 30, 4, 100)
    edge = Task("edge", "reached only from further right", "", np.array([[0.325, 0.0]]), 0.04, (2.7, 1.85))
    scores = other.score(population, weights * 0, edge)  # nothing moves: every output is 1/2
    assert (scores.goals_reached == 1).all()
    assert (PLAIN.score(population, weights * 0, edge).goals_reached == 0).all()


def test_noise_of_the_substitute_world_is_a_variance_of_8_or_its_square():
    lying = np.zeros((3000, 5), np.float32)
    sd = {}
    for name in ("snake", "snake+noise-8cm"):
        robot = load_robot(name)
        world = build(robot)
        sd[name] = robot.measured_displacements(world.drive(lying, KEY, Purpose.PROBE, 1))[:, :4].std(axis=0)
    np.testing.assert_allclose(sd["snake"], math.sqrt(8) / 100, rtol=0.05)
    np.testing.assert_allclose(sd["snake+noise-8cm"], 0.08, rtol=0.05)
    assert build(load_robot("snake")).digest != build(load_robot("snake+noise-8cm")).digest


def test_networks_begin_in_the_ranges_of_nguyen_and_widrow_where_asked():
    row = untrained(load_robot("snake+nguyen-widrow"), KEY)[0]
    neurons, limit = row[:-1].reshape(-1, PER_NEURON), 0.7 * 100**0.25
    for weights, low, high in ((neurons[:, :4], 0, limit), (neurons[:, INPUTS], -limit, limit), (neurons[:, -1], 0, 0.7)):
        assert (weights.min() >= low, weights.max() <= high) == (True, True)
        assert weights.mean() == pytest.approx((low + high) / 2, abs=0.2 * (high - low))
        assert np.ptp(weights) > 0.9 * (high - low)
    assert (neurons[:, 4] == 0).all()
    assert np.ptp(untrained(PLAIN, KEY)[0]) == pytest.approx(2, abs=0.05)


def test_a_flat_spot_reaches_the_training():
    spec = RunSpec(robot="snake", task="two-regions")
    assert Trainer.start(PLAIN, KEY, spec).rule.flat_spot == 0
    assert Trainer.start(load_robot("snake+flat-spot"), KEY, spec).rule.flat_spot == 0.1


def test_controllers_for_the_static_simulator_take_after_one_parent():
    other = evolving(PLAIN)
    assert other.switched_on == ("crossover-80",)
    assert evolving(load_robot("snake+rigid")).switched_on == ("crossover-80", "rigid")
    parents = PLAIN.initial_population(KEY, 2, 4, 100)
    order, cdf = rank(np.array([1.0, 0.0])), tournament_cdf(2, 1 / 2)
    shares = []
    for robot in (PLAIN, other):
        mine = []
        for generation in range(1, 60):
            children = Population(np.zeros((2, 10, 5), np.float32), parents.lengths.copy())
            robot.breed(KEY, parents, order, cdf, 0.0, 4, generation, children)
            share = np.mean(children.commands[1, :, 2] == parents.commands[0, :, 2])
            mine += [share] if 0 < share < 1 else []
        shares.append(np.mean(np.abs(np.array(mine) - 0.5)))
    assert shares[0] < 0.2
    assert shares[1] > 0.25


def test_readings_do_not_change_each_other():
    plain = PLAIN.initial_population(KEY, 5, 4, 100).commands
    for name in set(READINGS) - {"sorted-amplitudes"}:
        np.testing.assert_array_equal(load_robot(f"snake+{name}").initial_population(KEY, 5, 4, 100).commands, plain)
    assert replace(build(PLAIN)._simulator).digest == build(PLAIN).digest
