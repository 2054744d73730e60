"""Two objectives in one order, and what an archive of drives says of behaviours near them."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.approaches import start_approach
from bns.approaches.parts.pareto import ParetoEvolver, no_gap
from bns.approaches.transferability import TransferArchive, behaviours
from bns.bootstrap.simulators import PhysicsSimulator
from bns.engine.philox import Key
from bns.physics.model import load_model
from bns.robots import load_robot
from bns.robots.base import Scores
from bns.spec import RunSpec
from bns.tasks import load_task

ROBOT, TASK, KEY = load_robot("khepera"), load_task("khepera", "circle"), Key(3, 1)
SIMULATOR = PhysicsSimulator(ROBOT, TASK, load_model("khepera"))


def spec(**changes):
    small = {"population_size": 4, "generations_per_evaluation": 3, "max_commands": 8, "world": "physics", "evaluations": 6}
    return RunSpec(**small | {"approach": "transferability"} | changes)


def ordered(fitness, gaps):
    """Controllers of these objectives, from the first on; gaps up to 3.5 cm are tolerated."""
    evolver = ParetoEvolver.start(ROBOT, TASK, KEY, spec(population_size=len(fitness)), SIMULATOR)
    evolver.begin(SIMULATOR)
    evolver.scores = Scores(np.array(fitness), np.zeros(len(fitness), np.int32), 0)
    evolver._rank(lambda *_: np.array(gaps))
    return evolver.order.tolist()


def started():
    return start_approach(ROBOT, TASK, KEY, spec())


def test_the_fittest_of_a_tolerated_gap_comes_first_and_the_least_gap_where_none_is_tolerated():
    assert ordered([1.0, 4.0, 3.0, 2.0], [0.01, 0.5, 0.035, 0.02])[0] == 2
    assert ordered([1.0, 4.0, 3.0, 2.0], [0.2, 0.5, 0.1, 0.3])[0] == 2


def test_within_a_front_the_ends_come_before_the_middle_and_the_lonely_before_the_crowded():
    assert ordered([1.0, 2.0, 2.2, 4.0], [0.0, 0.01, 0.012, 0.03]) == [3, 0, 2, 1]


def test_failures_of_every_generation_under_two_objectives_are_counted():
    evolver = ParetoEvolver.start(ROBOT, TASK, KEY, spec(), SIMULATOR)
    evolver.begin(SIMULATOR)
    failing = SimpleNamespace(paths=SIMULATOR.paths, walk=lambda *_: Scores(np.ones(4), np.zeros(4, np.int32), 2))
    evolver.evolve_both(failing, no_gap)
    assert (evolver.generations, evolver.failures) == (3, 6)


def test_of_two_drives_one_twice_as_far_has_a_quarter_of_the_say():
    archive = TransferArchive()
    for x_m, gap_m in ((1.0, 0.5), (-2.0, 0.0)):
        archive.add(np.array([x_m, 0, x_m, 0, x_m, 0]), gap_m)
    expected = archive.expected_gap(np.zeros((1, 3, 3)), np.array([3]))
    assert expected == pytest.approx([0.5 / 1.25])


def test_what_is_driven_next_lies_far_from_every_drive_and_not_only_from_one():
    """Two drives ended 2 m apart: half way between them less is known than beside one."""
    approach = started()
    for x_m in (0.0, 2.0):
        approach.archive.add(np.array([x_m, 0, x_m, 0, x_m, 0]), 0.1)
    approach.pareto.fronts[:] = 0
    approach.pareto.paths = np.zeros_like(approach.pareto.paths)
    approach.pareto.paths[..., 0] = np.array([0.05, 1.0, 1.95, 0.0])[:, None]
    np.testing.assert_array_equal(approach.pick(1), approach.plan(approach.pareto.population.controller(1)))


def test_a_drive_that_was_cut_short_is_kept_as_the_behaviour_of_all_its_commands():
    approach = started()
    commands = ROBOT.random_controllers(KEY, 1, 6).controller(0)
    predicted = SIMULATOR.poses(commands)
    measured = predicted[:3] + np.array([0.03, 0.04, 0.0])
    approach.learn(commands, measured, 1)
    np.testing.assert_allclose(approach.archive.behaviours, behaviours(predicted[None], np.array([6])))
    assert approach.archive.gaps == pytest.approx([0.05])
