"""What holds for every approach that is registered: numbers from the seed alone, robot time charged, runs kept and resumed."""

import json

import numpy as np
import pytest

from bns.bootstrap.loop import run
from bns.errors import SpecError
from bns.registry import APPROACHES
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.store import load
from bns.worlds import build_world

TIMES = {"training_cpu_s", "evolution_cpu_s"}
SMALL = {
    "evaluations": 6, "population_size": 12, "generations_per_evaluation": 2, "training_iterations_per_evaluation": 5,
    "world": "physics", "max_commands": 12,
}  # fmt: skip
OPTIONS = {
    "precomputed": "+iterations=20",
    "then-on-robot": "+iterations=20+population=2",
    "on-robot": "+population=3",
    "back-to-reality": "+models=4+generations=2",
    "estimation-exploration": "+models=4+generations=2+candidates=5",
}
"""Small enough for a test, with more than one generation on the robot."""
SNAKE = ("bns", "on-robot", "precomputed", "then-on-robot")
NAMES = APPROACHES.names()


def spec(name, **changes):
    return RunSpec(**SMALL | {"approach": name + OPTIONS.get(name, "")} | changes)


def numbers(one, **how):
    evals = run(one, **how).tables["evals"]
    return {name: values for name, values in evals.items() if name not in TIMES}


def test_the_approaches_that_there_are():
    physical = {"anytime", "back-to-reality", "estimation-exploration", "transferability"}
    assert set(NAMES) >= physical | set(SNAKE)


@pytest.mark.parametrize("name", sorted(set(NAMES) - set(SNAKE)))
def test_approaches_on_a_model_of_two_wheels_say_so(name):
    with pytest.raises(SpecError, match=f"the approach {name}.* has a physics model of two wheels, and the snake has none"):
        run(spec(name, robot="snake", task="two-regions", world="substitute"))


@pytest.mark.parametrize("name", NAMES)
def test_the_same_seed_gives_the_same_numbers_and_another_seed_others(name):
    first, again, other = numbers(spec(name)), numbers(spec(name)), numbers(spec(name, seed=1))
    for column, values in first.items():
        np.testing.assert_array_equal(values, again[column], err_msg=column)
    assert not np.array_equal(first["evaluated_fitness_world"], other["evaluated_fitness_world"])
    assert not np.array_equal(first["driven_ms"], other["driven_ms"])


class CountingWorld:
    """A world that remembers what it drove for evaluations, and how often it was asked for anything else."""

    def __init__(self, one):
        self._world = build_world(one.world, load_robot(one.robot))
        self.digest, self.repeatable, self.renderable = self._world.digest, True, False
        self.driven, self.others = [], set()

    def drive(self, commands, key, purpose, step):
        if purpose.name == "WORLD_EVALUATED":
            self.driven.append(commands)
        else:
            self.others.add(purpose.name)
        return self._world.drive(commands, key, purpose, step)


@pytest.mark.parametrize("name", NAMES)
def test_every_drive_that_informs_is_an_evaluation_and_its_robot_time_is_charged(name):
    one = spec(name, overhead_s=7)
    world, robot = CountingWorld(one), load_robot(one.robot)
    evals = numbers(one, world=world)
    assert len(world.driven) == one.evaluations
    assert world.others == {"WORLD_FITTEST"}  # measured for the record, after the evaluation
    expected = np.cumsum([robot.driven_ms(commands) / 1000 + 7 for commands in world.driven])
    np.testing.assert_allclose(evals["robot_s"], expected)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_measured_alone_teaches_nothing(name):
    plain, full = numbers(spec(name)), numbers(spec(name, record="full"))
    np.testing.assert_array_equal(plain["evaluated_fitness_world"], full["evaluated_fitness_world"])


@pytest.mark.parametrize("name", SNAKE)
def test_approaches_without_wheels_run_on_the_snake(name):
    evals = numbers(spec(name, robot="snake", task="two-regions", world="substitute"))
    assert len(evals["evaluation"]) == 6
    assert np.isfinite(evals["fitness_world"]).all()


def test_the_default_approach_leaves_the_names_of_runs_as_they_were():
    assert RunSpec().run_id == RunSpec(approach="bns", overhead_s=30).run_id
    assert not {"approach", "overhead_s"} & set(json.loads(RunSpec().canonical_json()))
    assert RunSpec(approach="on-robot").run_id != RunSpec(approach="on-robot+population=10").run_id != RunSpec().run_id


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("on-robt", "unknown approach 'on-robt'. Did you mean 'on-robot'"),
        ("on-robot+size=3", r"unknown option of approach on-robot 'size'.*Valid: population"),
        ("on-robot+population=1", r"population is '1'; it must be a whole number from 2 to 10000 \(controllers"),
        ("on-robot+population=2.5", "must be a whole number"),
        ("on-robot+population", "population is ''; it must be"),
        ("on-robot+population=3+population=4", "population is given twice"),
        ("precomputed+data=1.5", "data is '1.5'; it must be a number from 0 to 1"),
    ],
)
def test_names_and_options_that_there_are_none_of(name, message):
    with pytest.raises(SpecError, match=message):
        RunSpec(approach=name)


@pytest.mark.slow
def test_the_command_line_a_sweep_and_its_resumption(bns, tmp_path):
    small = [f"--{key.replace('_', '-')}={value}" for key, value in SMALL.items()]
    done = bns("run", "--approach", "on-robot+population=3", *small, "--results", tmp_path)
    assert done.returncode == 0, done.stderr
    refused = bns("run", "--approach", "on-robot+population=3", *small, "--save-snn", tmp_path / "n.safetensors")
    assert refused.returncode == 2
    assert "has no networks to write" in refused.stderr
    fixed = "".join(f"  {key}: {value}\n" for key, value in SMALL.items())
    file = tmp_path / "few.yaml"
    grid = "grid:\n  approach: [bns, on-robot+population=3]\n"
    file.write_text(f"name: few\nrobot: khepera\nseeds: 1\nfixed:\n{fixed}{grid}")
    assert bns("sweep", file, "--results", tmp_path, "--jobs", 1).returncode == 0
    first = load(tmp_path)
    file.write_text(f"name: few\nrobot: khepera\nseeds: 2\nfixed:\n{fixed}{grid}")
    assert bns("sweep", file, "--results", tmp_path, "--jobs", 1).returncode == 0
    both = load(tmp_path)
    assert both[both.sweep == "few"].groupby(["approach", "seed"]).size().to_dict() == {
        (approach, seed): 6 for approach in ("bns", "on-robot+population=3") for seed in (0, 1)
    }
    kept = both.merge(first, on=["run_id", "sweep", "evaluation"])
    np.testing.assert_array_equal(kept.robot_s_x, kept.robot_s_y)  # runs that were there were not done again
    assert len(kept) == len(first)
