"""The next drive is the one that networks disagree on most: ``approach: bns+informed=...``."""

import numpy as np
import pytest

from bns.approaches import start_approach
from bns.approaches.parts.informed import SNAPSHOTS, disagreement, most_informative
from bns.bootstrap.loop import run
from bns.bootstrap.trainer import untrained
from bns.engine.evolution import Population
from bns.engine.philox import Key
from bns.errors import SpecError
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task

SMALL = {"evaluations": 6, "population_size": 20, "generations_per_evaluation": 3, "training_iterations_per_evaluation": 5}
SNAKE = SMALL | {"robot": "snake", "task": "two-regions"}
KEY = Key(3, 4)


def numbers(approach, **changes):
    evals = run(RunSpec(**SMALL | {"approach": approach} | changes)).tables["evals"]
    return {name: list(evals[name]) for name in ("best_fitness", "fitness_world", "evaluated_fitness_world", "driven_ms")}


def started(approach):
    spec = RunSpec(**SMALL | {"approach": approach})
    return start_approach(load_robot("khepera"), load_task("khepera", "circle"), KEY, spec)


def taught(approach, rounds=SNAPSHOTS):
    robot = load_robot("khepera")
    for number in range(1, rounds + 1):
        commands = robot.random_controllers(KEY, 10, 8).controller(number)
        approach.learn(commands, robot.poses(np.random.default_rng(number).normal(size=(8, 3)) / 20), number)
        approach.advance()
    return approach


def spread_of(robot, committee, controller):
    """The slow twin: network by network, command by command."""
    displacements = [robot.targets(robot.displacements(_said(robot, one, controller))) for one in committee]
    return sum(np.var([said[net, c] for said in displacements]) for net in range(3) for c in range(len(controller)))


def _said(robot, networks, controller):
    from bns.engine.snn import predict

    return predict(networks, robot.inputs(controller))


def test_a_share_of_nothing_leaves_the_tournament_as_it_was():
    assert numbers("bns") == numbers("bns+informed=0") != numbers("bns+informed=0.5")


@pytest.mark.parametrize("name", ["bns+informed=0.5", "bns+informed=0.5+ensemble=3"])
def test_an_informed_choice_goes_by_the_seed(name):
    assert numbers(name) == numbers(name) != numbers(name, seed=1)


def test_disagreement_is_the_variance_of_what_networks_say_and_more_commands_add_to_it():
    robot = load_robot("khepera")
    committee = [untrained(robot, Key(0, number)) for number in range(3)]
    population = robot.initial_population(KEY, 8, 4, 20)
    who = np.array([5, 0, 3])
    found = disagreement(robot, committee, population, who)
    expected = [spread_of(robot, committee, population.controller(one)) for one in who]
    np.testing.assert_allclose(found, expected, rtol=1e-4)
    shorter = Population(population.commands, np.maximum(population.lengths - 2, 1))
    assert (disagreement(robot, committee, shorter, who) < found).all()


def test_only_the_fitter_ones_are_asked_and_networks_that_agree_leave_the_fittest():
    robot = load_robot("khepera")
    committee = [untrained(robot, Key(0, number)) for number in range(2)]
    population, order = robot.initial_population(KEY, 20, 4, 20), np.arange(20)[::-1]
    everybody = disagreement(robot, committee, population, np.arange(20))
    assert most_informative(robot, committee, population, order, 1.0) == int(everybody.argmax())
    assert most_informative(robot, committee, population, order, 0.25) == 15 + int(everybody[15:].argmax())
    assert most_informative(robot, committee, population, order, 0.001) == 19
    assert most_informative(robot, committee[:1] * 2, population, order, 1.0) == 19
    assert most_informative(robot, committee[:1], population, order, 1.0) is None


def test_without_an_ensemble_the_committee_are_the_latest_rounds_and_with_one_its_members():
    approach = taught(started("bns+informed=0.5"), rounds=SNAPSHOTS + 2)
    assert len(approach._latest) == SNAPSHOTS
    np.testing.assert_array_equal(approach._latest[-1], approach.weights)
    assert not np.array_equal(approach._latest[0], approach._latest[-1])
    for name in ("bns+informed=0.5", "bns+informed=0.5+ensemble=3"):
        approach = taught(started(name))
        committee = approach.trainer.networks() if "ensemble" in name else approach._latest
        best_half = approach.evolver.order[:10]
        spreads = [spread_of(load_robot("khepera"), committee, approach.evolver.population.controller(i)) for i in best_half]
        expected = approach.evolver.population.controller(int(best_half[int(np.argmax(spreads))]))
        np.testing.assert_array_equal(approach.pick(9), expected)


def test_before_there_is_a_committee_the_tournament_decides():
    informed, plain = started("bns+informed=0.5"), started("bns")
    np.testing.assert_array_equal(informed.pick(1), plain.pick(1))


def test_the_snake_is_chosen_for_likewise():
    assert numbers("bns+informed=0.5", **SNAKE) != numbers("bns", **SNAKE)


def test_a_share_that_cannot_be_is_refused():
    with pytest.raises(SpecError, match=r"informed is '2'; it must be a number from 0 to 1 \(fraction of the population"):
        RunSpec(approach="bns+informed=2")
