"""Several networks for each displacement: ``approach: bns+ensemble=3+use=...``."""

import numpy as np
import pytest

from bns.approaches import start_approach
from bns.approaches.parts.ensemble import WorstSimulator
from bns.bootstrap.loop import run
from bns.bootstrap.simulators import NetworkSimulator
from bns.bootstrap.trainer import Trainer, untrained
from bns.engine.philox import Key
from bns.engine.snn import predict, side_by_side
from bns.errors import SpecError
from bns.robots import load_robot
from bns.robots.base import RandomStream
from bns.robots.simulator import StaticSimulator, load_simulator, save_simulator
from bns.spec import RunSpec
from bns.tasks import load_task

SMALL = {"evaluations": 4, "population_size": 20, "generations_per_evaluation": 3, "training_iterations_per_evaluation": 5}
SNAKE = SMALL | {"robot": "snake", "task": "two-regions"}
USES = ("mean", "worst", "sampled")
KEY = Key(3, 4)


def numbers(approach, **changes):
    evals = run(RunSpec(**SMALL | {"approach": approach} | changes)).tables["evals"]
    return {name: list(evals[name]) for name in ("best_fitness", "fitness_world", "training_error", "driven_ms")}


def started(approach, **changes):
    spec = RunSpec(**SMALL | {"approach": approach} | changes)
    return start_approach(load_robot(spec.robot), load_task(spec.robot, spec.task), KEY, spec)


def driven(approach, evaluations=3):
    robot = load_robot(approach.setting.spec.robot)
    for evaluation in range(1, evaluations + 1):
        commands = robot.random_controllers(KEY, 10, 12).controller(evaluation)
        moved = np.random.default_rng(evaluation).normal(size=(12, len(robot.networks))) / 20
        approach.learn(commands, robot.poses(moved, commands), evaluation)
    return approach


def test_one_network_gives_the_numbers_that_there_were_and_several_give_others():
    plain = numbers("bns")
    assert plain == numbers("bns+ensemble=1+use=mean")
    found = [plain, *(numbers(f"bns+ensemble=3+use={use}") for use in USES)]
    assert len({tuple(one["best_fitness"]) for one in found}) == 4


@pytest.mark.parametrize("use", USES)
def test_an_ensemble_goes_by_the_seed(use):
    name = f"bns+ensemble=2+use={use}"
    assert numbers(name) == numbers(name) != numbers(name, seed=1)


def test_networks_side_by_side_say_the_sum():
    robot, X = load_robot("khepera"), np.random.default_rng(0).normal(size=(5, 40)).astype(np.float32)
    parts = [untrained(robot, Key(0, number)) for number in range(3)]
    mean = np.mean([predict(part, X) for part in parts], axis=0)
    np.testing.assert_allclose(predict(side_by_side(parts, 1 / 3), X), mean, atol=2e-6)
    np.testing.assert_array_equal(side_by_side(parts[:1]), parts[0])


def test_members_begin_differently_and_see_rows_as_often_as_a_poisson_draw_says():
    ensemble = driven(started("bns+ensemble=40")).trainer
    first, second = ensemble.networks()[:2]
    np.testing.assert_array_equal(first, untrained(load_robot("khepera"), KEY))
    assert not np.isclose(first, second).any(axis=0).all()
    assert ensemble.times.shape == (40, ensemble.data.training.count)
    assert ensemble.times.mean() == pytest.approx(1.0, abs=0.1)
    assert (ensemble.times == 0).mean() == pytest.approx(np.exp(-1), abs=0.04)
    assert len(np.unique(ensemble.times, axis=0)) == 40


def test_a_row_that_counts_twice_is_learned_from_as_if_it_were_there_twice():
    approach = driven(started("bns+ensemble=2"))
    member, times = approach.trainer.members[1], approach.trainer.times[1].astype(int)
    approach.trainer.train()
    patterns = member.data.training
    robot, twin = load_robot("khepera"), Trainer.start(load_robot("khepera"), member.key, RunSpec(**SMALL))
    kept = np.repeat(np.arange(patterns.count), times)
    twin.data.training.add(patterns.inputs[:, kept], patterns.targets[:, kept])
    twin.train()
    X = robot.inputs(robot.random_controllers(KEY, 1, 50).controller(0))
    np.testing.assert_allclose(predict(member.rule.weights, X), predict(twin.rule.weights, X), atol=1e-4)
    assert times.max() > 1


@pytest.mark.parametrize("spec", [SMALL, SNAKE], ids=["khepera", "snake"])
def test_the_worst_is_the_least_of_the_members_fitnesses_with_parents_and_without(spec):
    approach = started("bns+ensemble=3+use=worst", **spec)
    approach.advance()
    evolver, simulator = approach.evolver, approach.simulator
    assert isinstance(simulator, WorstSimulator)
    stream = RandomStream(KEY, evolver.generations)
    each = [member.score(evolver.population, stream) for member in simulator.members]
    np.testing.assert_array_equal(evolver.scores.fitness, np.min([one.fitness for one in each], axis=0))
    worst = np.argmin([one.fitness for one in each], axis=0)
    reached = [each[who].goals_reached[i] for i, who in enumerate(worst)]
    np.testing.assert_array_equal(evolver.scores.goals_reached, reached)
    assert len(set(worst)) > 1 or spec is SNAKE


def test_a_member_is_drawn_for_every_round():
    approach, found = driven(started("bns+ensemble=3+use=sampled")), []
    for _ in range(12):
        approach.advance()
        networks = approach.trainer.networks()
        assert isinstance(approach.simulator, NetworkSimulator)
        found += [i for i, one in enumerate(networks) if np.array_equal(one, approach.simulator.weights)]
    assert len(found) == 12
    assert set(found) == {0, 1, 2}


@pytest.mark.parametrize("use", USES)
def test_the_snake_takes_an_ensemble(use):
    assert np.isfinite(numbers(f"bns+ensemble=2+use={use}", **SNAKE)["fitness_world"]).all()


def test_the_mean_can_be_kept_and_read_again(tmp_path):
    kept = run(RunSpec(**SMALL | {"approach": "bns+ensemble=3"}))
    file = tmp_path / "mean.safetensors"
    save_simulator(StaticSimulator(kept.networks, kept.weights, np.empty(0), {}, kept.learned_from), file)
    np.testing.assert_array_equal(load_simulator(file).weights, kept.weights)


@pytest.mark.parametrize(
    ("approach", "said"),
    [
        ("bns+ensemble=3+use=best", r"use is 'best'; it must be one of mean, worst, sampled \(what evolution works on"),
        ("bns+ensemble=0", "ensemble is '0'; it must be a whole number from 1 to 100"),
        ("bns+use=worst", r"bns\+use=worst: there is one network; add networks, such as ensemble=3"),
    ],
)
def test_what_cannot_be_is_refused(approach, said):
    with pytest.raises(SpecError, match=said):
        run(RunSpec(**SMALL | {"approach": approach}))


def test_what_a_member_forgets_are_the_counts_of_the_oldest_rows():
    ensemble = started("bns+ensemble=3").trainer
    robot = load_robot("khepera")
    for drive in (1, 2, 3):
        commands = robot.random_controllers(KEY, 4, 20).controller(drive)
        ensemble.add(commands, robot.poses(np.random.default_rng(drive).normal(size=(len(commands), 3)) / 20), drive)
    before = ensemble.times.copy()
    inputs = ensemble.data.training.inputs[:, : before.shape[1]].copy()
    ensemble.forget(2)
    left = ensemble.data.training.count
    assert 0 < left < before.shape[1]
    np.testing.assert_array_equal(ensemble.data.training.inputs[:, :left], inputs[:, -left:])
    np.testing.assert_array_equal(ensemble.times, before[:, -left:])
