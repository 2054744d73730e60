"""A population that reaches nothing for long is replaced: ``approach: bns+renew=...``."""

import numpy as np
import pytest

from bns.approaches.bns import BootstrappedNeuroSimulation
from bns.approaches.parts.base import Setting
from bns.bootstrap.loop import run
from bns.engine.philox import Key
from bns.errors import SpecError
from bns.options import parsed_options
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task

SMALL = {"evaluations": 8, "population_size": 20, "generations_per_evaluation": 3, "training_iterations_per_evaluation": 5}


TASKS = {"khepera": load_task("khepera", "circle"), "snake": load_task("snake", "two-regions")}


def started(name, robot="khepera"):
    spec = RunSpec(robot=robot, task=TASKS[robot].name, approach=name, **SMALL)
    options = parsed_options(name, BootstrappedNeuroSimulation.options)
    approach = BootstrappedNeuroSimulation.start(Setting(load_robot(robot), TASKS[robot], Key(0, 0), spec, options))
    approach.train = approach.copy = lambda: None
    return approach


@pytest.mark.parametrize("robot", ["khepera", "snake"])
def test_after_so_many_rounds_in_vain_all_controllers_are_random_and_the_networks_stay(robot):
    approach = started("bns+renew=3", robot)
    evolver, goals = approach.evolver, len(TASKS[robot].goals_m)
    before, weights, renewed = evolver.population.commands.copy(), approach.weights, []
    for reached in [goals - 1] * 7 + [goals] * 4 + [0] * 4:
        approach.evolve = lambda reached=reached: evolver.scores.goals_reached.fill(reached)
        approach.advance()
        renewed.append(bool((evolver.population.commands != before).any()))
        before = evolver.population.commands.copy()
    assert renewed == [*[False] * 3, True, False, False, True, *[False] * 7, True]
    assert approach.weights is weights
    assert (evolver.population.origin[:, 0] == -1).all()  # nothing that was computed of their parents is taken for theirs


def test_each_new_population_is_another_and_none_is_the_first():
    approach = started("bns+renew=1")
    seen = [approach.evolver.population.commands.copy()]
    approach.evolve = lambda: approach.evolver.scores.goals_reached.fill(0)
    for _ in range(3):
        approach.advance()
        seen.append(approach.evolver.population.commands.copy())
    assert len({population.tobytes() for population in seen}) == 3  # the first round had nothing to give up


def test_never_by_default_and_the_same_numbers_then():
    fitness = {
        name: np.array(run(RunSpec(approach=name, **SMALL)).tables["evals"]["best_fitness"])
        for name in ("bns", "bns+renew=0", "bns+renew=1000", "bns+renew=2")
    }
    assert (fitness["bns"] == fitness["bns+renew=0"]).all()
    assert (fitness["bns"] == fitness["bns+renew=1000"]).all()
    assert (fitness["bns"] == fitness["bns+renew=2"])[:3].all()
    assert (fitness["bns"] != fitness["bns+renew=2"])[3:].any()


def test_rounds_are_a_whole_number():
    with pytest.raises(SpecError, match=r"renew is '2\.5'; it must be a whole number from 0 to 1000"):
        run(RunSpec(approach="bns+renew=2.5", **SMALL))


def test_whoever_takes_a_place_is_new_and_the_others_keep_where_they_come_from():
    evolver = started("bns").evolver
    evolver.population.origin[:] = 7
    others = evolver.robot.initial_population(Key(5, 5), len(evolver.population), 4, evolver.spec.max_commands)
    evolver.replace(np.array([1, 3]), others)
    new = (evolver.population.origin == -1).all(axis=1)
    assert np.flatnonzero(new).tolist() == [1, 3]
    assert (evolver.population.origin[~new] == 7).all()
    np.testing.assert_array_equal(evolver.population.controller(3), others.controller(3))
