"""Evolution on the robot, alone and after one in simulation: whose turn it is, what is kept, and what goes over."""

import numpy as np
import pytest

from bns.approaches import start_approach
from bns.bootstrap.loop import run
from bns.engine.evolution import Population
from bns.engine.philox import Key, Purpose
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task
from bns.worlds import build_world

ROBOT, TASK, KEY = load_robot("khepera"), load_task("khepera", "circle"), Key(3, 4)
SMALL = {"evaluations": 12, "population_size": 8, "generations_per_evaluation": 2, "world": "physics", "max_commands": 12}
THEN = "then-on-robot+data=0.2+iterations=5+population=3"


def started(approach):
    return start_approach(ROBOT, TASK, KEY, RunSpec(approach=approach, **SMALL))


@pytest.fixture
def bred():
    """A population of four, all of whom were driven: the second was best."""
    evolution = started("on-robot+population=4").on_robot
    before = [evolution.population.controller(i) for i in range(4)]
    for place, (fitness, reached) in enumerate([(1.0, 1), (3.0, 2), (2.0, 0), (0.5, 0)]):
        np.testing.assert_array_equal(evolution.next(), before[place])
        evolution.driven(fitness, reached)
    return evolution, before


def test_the_best_goes_on_with_what_it_reached_and_is_not_driven_again(bred):
    evolution, before = bred
    np.testing.assert_array_equal(evolution.population.controller(0), before[1])
    np.testing.assert_array_equal(evolution.fitness, [3.0, np.nan, np.nan, np.nan])
    assert evolution.reached.tolist() == [2, 0, 0, 0]
    np.testing.assert_array_equal(evolution.next(), evolution.population.controller(1))
    np.testing.assert_array_equal(evolution.fittest(), before[1])
    evolution.driven(4.0, 1)
    np.testing.assert_array_equal(evolution.fittest(), evolution.population.controller(1))


def test_measured_fitness_is_that_of_those_driven(bred):
    evolution, _ = bred
    assert {name: evolution.measures()[name] for name in ("best_fitness", "mean_fitness", "generations")} == {
        "best_fitness": 3.0, "mean_fitness": 3.0, "generations": 1,
    }  # fmt: skip
    evolution.driven(1.0, 0)
    assert (evolution.measures()["best_fitness"], evolution.measures()["mean_fitness"]) == (3.0, 2.0)


def test_before_any_drive_no_fitness_is_known_and_the_first_stands_in():
    evolution = started("on-robot+population=4").on_robot
    assert np.isnan([evolution.measures()[name] for name in ("best_fitness", "mean_fitness")]).all()
    np.testing.assert_array_equal(evolution.fittest(), evolution.population.controller(0))


def test_no_two_generations_are_bred_by_the_same_draws(monkeypatch):
    """In simulation and on the robot both are counted from 1."""
    draws, breed = [], type(ROBOT).breed

    def noting(self, key, parents, order, cdf, rate, shortest, generation, children):
        draws.append((key, generation))
        return breed(self, key, parents, order, cdf, rate, shortest, generation, children)

    monkeypatch.setattr(type(ROBOT), "breed", noting)
    generations = run(RunSpec(approach=THEN, **SMALL)).tables["evals"]["generations"]
    assert len(set(draws)) == len(draws) == generations[-1]
    assert len({key for key, _ in draws}) == 2


def test_the_best_different_controllers_go_over_each_once():
    approach = started(THEN)
    lists = [np.full((2 + i, 3), 100 + i, np.float32) for i in (0, 1, 0, 3)]  # the first and the third are the same
    commands, lengths = np.zeros((4, 12, 3), np.float32), np.array([len(one) for one in lists], np.int32)
    for place, one in enumerate(lists):
        commands[place, : len(one)] = one
    approach.evolver.population, approach.evolver.order = Population(commands, lengths), np.array([2, 3, 0, 1])
    for count, expected in ((2, [2, 3]), (3, [2, 3, 1]), (5, [2, 3, 1, 2, 2])):
        gone = approach._best(count)
        assert len(gone) == count
        for i, place in enumerate(expected):
            np.testing.assert_array_equal(gone.controller(i), lists[place])
    gone.commands[:] = 0
    assert approach.evolver.population.commands.any()


def test_once_on_the_robot_evolution_in_simulation_has_ended_and_its_generations_count():
    approach, world, counted = started(THEN), build_world("physics", ROBOT), []
    for evaluation in range(1, 9):
        commands = approach.pick(evaluation)
        approach.learn(commands, world.drive(commands, KEY, Purpose.WORLD_EVALUATED, evaluation), evaluation)
        approach.advance()
        counted.append(approach.measures()["generations"])
        if evaluation == 2:  # a fifth of twelve evaluations were random: the robot takes over
            best = [approach.evolver.population.controller(int(i)) for i in approach.evolver.order]
            np.testing.assert_array_equal(approach.on_robot.next(), best[0])
            in_simulation = approach.evolver.generations
            assert in_simulation >= 2
    assert counted[0] == 0
    assert [one - in_simulation for one in counted[1:]] == [0, 0, 0, 1, 1, 2, 2]  # three drives, then two a generation
    assert approach.evolver.generations == in_simulation
    assert not approach.simulator.foretells
