"""Fitness on any simulator: the same walk for networks and models, and a coarse step that costs nothing that counts."""

import numpy as np
import pytest

from bns.approaches.parts.pareto import fronts_of
from bns.approaches.parts.physics_models import COMMON, Drives, ModelSpace
from bns.bootstrap.simulators import NetworkSimulator, NoSimulator, PhysicsSimulator
from bns.engine.philox import Key, Purpose
from bns.engine.snn import initial_weights, predict
from bns.physics.model import load_model
from bns.physics.wheels.khepera_drive import KheperaPhysics
from bns.robots import load_robot
from bns.tasks import default_task, load_task

KHEPERA, TASK, KEY = load_robot("khepera"), load_task("khepera", "circle"), Key(3, 1)


@pytest.mark.parametrize("name", ["khepera", "snake"])
def test_the_walk_over_displacements_of_networks_is_their_score(name):
    robot = load_robot(name)
    task = load_task(name, default_task(name))
    weights = initial_weights(KEY, len(robot.networks), robot.hidden, robot.input_count)
    population = robot.initial_population(KEY, 40, 4, 12)
    each = [population.commands[i, : population.lengths[i]] for i in range(40)]
    moved = [robot.displacements(predict(weights, robot.inputs(one), robot.sigmoid_output)) for one in each]
    scores, walked = robot.score(population, weights, task), robot.walk(population, np.vstack(moved), task)
    np.testing.assert_allclose(walked.fitness, scores.fitness, rtol=1e-5)
    np.testing.assert_array_equal(walked.goals_reached, scores.goals_reached)


def test_a_model_s_scores_are_those_of_its_drives_in_the_world():
    model = load_model("khepera").with_effect("motor-lag", tau_s=0.08).with_effect("speed-gain", gain=0.95)
    simulator, world = PhysicsSimulator(KHEPERA, TASK, model), KheperaPhysics(KHEPERA, model)  # neither jitter nor noise
    population = KHEPERA.initial_population(KEY, 30, 4, 13)
    scores = simulator.score(population)
    for i in range(30):
        driven = world.drive(population.controller(i), KEY, Purpose.PROBE, 1)
        np.testing.assert_allclose(simulator.poses(population.controller(i)), driven, atol=1e-3)
        assert scores.fitness[i] == pytest.approx(KHEPERA.evaluate_path(driven, TASK)[0], rel=1e-2)


def test_displacements_of_many_lists_at_once_are_those_of_each_list():
    simulator, seen = PhysicsSimulator(KHEPERA, TASK, load_model("khepera")), []
    population = KHEPERA.initial_population(KEY, 30, 4, 13)
    paths = simulator.paths(population)

    class Watched(type(KHEPERA)):
        def walk(self, population, displacements, task, stream=None):
            seen.append(displacements)

    PhysicsSimulator(Watched(), TASK, simulator.model).walk(population, paths)
    each = [KHEPERA.measured_displacements(path[:n]) for path, n in zip(paths, population.lengths, strict=True)]
    np.testing.assert_array_equal(seen[0], np.vstack(each))


def test_without_a_simulator_paths_are_unknown_and_nobody_is_fit():
    simulator, population = NoSimulator(KHEPERA, TASK), KHEPERA.initial_population(KEY, 5, 4, 8)
    assert np.isnan(simulator.poses(population.controller(0))).all()
    assert simulator.score(population).fitness.tolist() == [0] * 5
    assert not simulator.foretells
    assert NetworkSimulator(KHEPERA, TASK, initial_weights(KEY, 3, 20)).foretells


def test_errors_of_models_are_zero_at_the_truth_alone():
    space = ModelSpace.of(KHEPERA, COMMON)
    truth = np.array([0.5, -1.0, 2.0, 0.5, 0.3])
    drives, world = Drives(KHEPERA, TASK), KheperaPhysics(KHEPERA, space.model(truth))
    for i in range(3):
        commands = KHEPERA.random_controllers(KEY, 3, 6 + i).controller(i)
        drives.add(commands, world.drive(commands, KEY, Purpose.PROBE, 1))
    assert drives.error(space.model(truth)) < 0.05
    assert drives.error(space.drawing) > 1
    assert drives.fitness_error(space.model(truth)) < 1e-2 * drives.fitness_error(space.drawing)
    assert len(drives.residuals(space.drawing, 1)) == 8  # of the latest drive alone
    assert space.model(np.zeros(5)).values_of("speed-gain") == {"gain": 1.0}
    assert space.model(np.full(5, 1e9)).values_of("motor-lag") == {"tau_s": 1.0}  # cut at what is plausible


def test_fronts_begin_with_what_nothing_is_better_than_and_end_with_repetitions():
    objectives = np.array([[1.0, 4], [2, 2], [4, 1], [3, 3], [2, 2], [5, 5]])
    fronts, crowding = fronts_of(objectives)
    assert fronts.tolist() == [0, 0, 0, 1, 6, 2]
    assert np.isinf(crowding[[0, 2]]).all()
    assert np.isfinite(crowding[1])
