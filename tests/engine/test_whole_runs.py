"""Whole runs: same seed same numbers, every parameter counts, extremes, worlds that fail."""

import dataclasses

import numpy as np
import pytest

from bns.bootstrap.loop import run
from bns.engine.philox import Key
from bns.engine.snn import initial_weights, predict
from bns.robots import load_robot
from bns.spec import FIELDS, RunSpec

ROBOT = load_robot("khepera")
SMALL = RunSpec(
    population_size=14,
    evaluations=6,
    generations_per_evaluation=4,
    training_iterations_per_evaluation=30,
    max_commands=12,
)
OTHER = {
    "task": "infinity", "world": "physics", "seed": 1, "root_seed": 1, "population_size": 15, "tournament_size": 0.1,
    "mutation_rate": 0.5, "real_world_selection_size": 0.1, "evaluations": 5, "generations_per_evaluation": 5,
    "training_iterations_per_evaluation": 31, "training_algorithm": "irprop-", "min_commands": 8, "max_commands": 4,
    "record": "full", "approach": "on-robot", "overhead_s": 5.0,
}  # fmt: skip


def but(**changes):
    return dataclasses.replace(SMALL, **changes)


def evals(spec, world=None):
    """The numbers that must be the same every time."""
    columns = run(spec, world=world).tables["evals"]
    return {name: values for name, values in columns.items() if not name.endswith("_s")}


def same(one, two):
    return all(np.array_equal(one[name], two[name], equal_nan=one[name].dtype.kind == "f") for name in one)


def test_same_spec_same_numbers():
    assert same(evals(SMALL), evals(SMALL))
    everything = [run(but(record="full")).tables for _ in range(2)]
    for table in ("paths", "generations", "probes"):
        assert same(everything[0][table], everything[1][table])


@pytest.mark.parametrize("name", sorted(FIELDS.keys() - {"robot"}))
def test_every_parameter_changes_something(name):
    before, after = run(SMALL).tables, run(but(**{name: OTHER[name]})).tables
    if name == "record":
        assert set(after) - set(before) == {"paths", "generations", "probes"}
        assert same(evals(SMALL), evals(but(record="full")))  # looking more closely changes nothing
    elif name == "overhead_s":
        assert not np.array_equal(before["evals"]["robot_s"], after["evals"]["robot_s"])
    else:
        a, b = before["evals"], after["evals"]
        assert not np.array_equal(a["fitness_simulation"], b["fitness_simulation"])


def test_fewer_evaluations_are_the_beginning_of_more():
    short, long = evals(but(evaluations=3)), evals(SMALL)
    assert same(short, {name: values[:3] for name, values in long.items()})


def test_combinations_meet_the_same_luck():
    """What is drawn does not depend on the parameters: before anything is learnt, the same drive has the same end."""
    one, two = (
        evals(but(mutation_rate=rate, training_iterations_per_evaluation=n)) for rate, n in ((0.0, 5), (1.0, 50))
    )
    assert one["evaluated_fitness_world"][0] == two["evaluated_fitness_world"][0]
    assert one["fitness_world"][-1] != two["fitness_world"][-1]


EXTREMES = {
    "one controller": {"population_size": 1},
    "two controllers": {"population_size": 2},
    "one command": {"min_commands": 1, "max_commands": 1},
    "no mutation": {"mutation_rate": 0.0},
    "nothing but mutation": {"mutation_rate": 1.0},
    "tournaments of all": {"tournament_size": 1.0, "real_world_selection_size": 1.0},
    "tournaments of none": {"tournament_size": 0.0, "real_world_selection_size": 0.0},
    "tiny tournaments": {"tournament_size": 1e-12, "real_world_selection_size": 1e-12},
    "no generations": {"generations_per_evaluation": 0},
    "no training": {"training_iterations_per_evaluation": 0},
    "one evaluation": {"evaluations": 1},
}


@pytest.mark.parametrize("changes", EXTREMES.values(), ids=EXTREMES.keys())
def test_extremes_give_rows_like_any_other(changes):
    spec = but(**changes)
    columns = evals(spec)
    assert columns["evaluation"].tolist() == list(range(1, spec.evaluations + 1))
    expected = spec.generations_per_evaluation * spec.evaluations
    assert columns["generations"][-1] == expected
    for name in columns.keys() - {"training_error", "validation_error"}:
        assert np.isfinite(columns[name].astype(float)).all(), name
    assert (columns["training_patterns"] + columns["validation_patterns"])[-1] == columns["commands"].sum()
    assert columns["fittest_commands"].max() <= spec.max_commands


def test_errors_are_unknown_while_there_is_no_pattern_and_known_thereafter():
    columns = evals(but(min_commands=1, max_commands=1, seed=3))
    for which in ("training", "validation"):
        unknown = np.isnan(columns[f"{which}_error"])
        np.testing.assert_array_equal(unknown, columns[f"{which}_patterns"] == 0)
    assert np.isnan(columns["validation_error"]).any()


class Silent:
    """A world without noise, which answers as networks do that nobody trained; it remembers what it was asked."""

    digest = "w-silent"
    repeatable = True

    def __init__(self):
        self.asked = []

    def drive(self, commands, key, purpose, step):
        self.asked.append((int(purpose), step, len(commands)))
        weights = initial_weights(Key(99, 0), 3, 20)
        return ROBOT.poses(ROBOT.displacements(predict(weights, ROBOT.inputs(commands))))


class Broken(Silent):
    """Now and then its last pose is not a number."""

    def __init__(self, value):
        super().__init__()
        self.value = value

    def drive(self, commands, key, purpose, step):
        poses = super().drive(commands, key, purpose, step)
        if step % 2:
            poses[-1] = self.value
        return poses


def test_without_noise_networks_learn_the_world_and_evolution_reaches_further():
    spec = but(
        evaluations=15, training_iterations_per_evaluation=500, generations_per_evaluation=10, population_size=60
    )
    columns = evals(spec, Silent())
    assert columns["training_error"][-1] < 1e-3
    assert columns["validation_error"][-1] < columns["validation_error"][0] / 5
    assert columns["fitness_world"][-5:].mean() > columns["fitness_world"][:3].mean()


def test_the_world_is_asked_once_for_each_purpose_and_evaluation():
    world = Silent()
    run(SMALL, world=world)
    assert len(world.asked) == len({(purpose, step) for purpose, step, _ in world.asked}) == 2 * SMALL.evaluations


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.filterwarnings("ignore:invalid value encountered:RuntimeWarning")  # as it should: the poses are made so
def test_poses_that_are_not_finite_are_not_learnt_and_are_counted(value):
    columns = evals(SMALL, Broken(value))
    assert columns["arithmetic_failures"][-1] == 3
    learnt = (columns["training_patterns"] + columns["validation_patterns"])[-1]
    assert learnt == columns["commands"].sum() - 3
    assert columns["fitness_world"][::2].tolist() == columns["evaluated_fitness_world"][::2].tolist() == [0] * 3
    for name in ("training_error", "best_fitness", "mean_fitness", "diversity", "fitness_error"):
        assert np.isfinite(columns[name]).all()
