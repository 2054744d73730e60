"""A robot that changes half way, and what ``bns+window=...`` and ``bns+restart=...`` make of it."""

from importlib import resources

import numpy as np
import pytest

from bns.approaches import start_approach
from bns.approaches.parts.surprise import FEWEST, Surprise
from bns.bootstrap.loop import run
from bns.change import change_of
from bns.engine.philox import Key, Purpose
from bns.errors import SpecError
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.sweep.expand.grid import load_sweep
from bns.sweep.expand.order import ordered_specs
from bns.tasks import load_task
from bns.worlds import build_world
from bns.worlds.logged import LoggedWorld

SMALL = {"evaluations": 5, "population_size": 20, "generations_per_evaluation": 3, "training_iterations_per_evaluation": 5}
LEARNING = {"population_size": 40, "generations_per_evaluation": 5, "training_iterations_per_evaluation": 500}
KEY = Key(3, 4)
ROBOT = load_robot("khepera")


@pytest.fixture
def worn(tmp_path):
    """The robot's world with a left wheel that has become smaller."""
    text = (resources.files("bns.physics") / "khepera-world.yaml").read_text()
    assert "ratio: 1.004" in text
    (tmp_path / "worn.yaml").write_text(text.replace("ratio: 1.004", "ratio: 1.2"))
    return tmp_path / "worn.yaml"


def evals(**changes):
    return run(RunSpec(**SMALL | changes)).tables["evals"]


def taught(approach, drives):
    for number in range(1, drives + 1):
        commands = ROBOT.random_controllers(KEY, 20, 8).controller(number)
        approach.learn(commands, ROBOT.poses(np.random.default_rng(number).normal(size=(8, 3)) / 20), number)
    return approach


def started(approach):
    return start_approach(ROBOT, load_task("khepera", "circle"), KEY, RunSpec(**SMALL | {"approach": approach}))


def test_a_change_is_two_worlds_and_an_evaluation():
    assert change_of("physics") is None
    assert change_of("physics>a@b/worn.yaml@50") == ("physics", "a@b/worn.yaml", 50)


@pytest.mark.parametrize(
    ("world", "said"),
    [
        ("physics>worn.yaml", r"written BEFORE>AFTER@N, such as physics>worn\.yaml@50"),
        ("physics>worn.yaml@1", "N is 2 at least"),
        (">worn.yaml@3", "written BEFORE>AFTER@N"),
        ("physics>substitute>physics@3", "written BEFORE>AFTER@N"),
        ("physics>substitut@3", "unknown world 'substitut'. Did you mean 'substitute'"),
        ("physics>robot@3", "a real robot does not change by itself"),
        ("physics>substitute@6", "which changes at evaluation 6; the run has 5 evaluations"),
    ],
)
def test_a_change_that_cannot_be_is_refused(world, said):
    with pytest.raises(SpecError, match=said):
        RunSpec(**SMALL | {"world": world})


def test_the_second_world_answers_from_its_evaluation_on(worn):
    before, after = (build_world(name, ROBOT) for name in ("physics", str(worn)))
    world = LoggedWorld(build_world(f"physics>{worn}@3", ROBOT), ROBOT)
    commands = ROBOT.random_controllers(KEY, 1, 5).controller(0)
    for step, now in ((1, before), (2, before), (3, after), (4, after)):
        for purpose in (Purpose.WORLD_EVALUATED, Purpose.WORLD_FITTEST):
            expected = now.drive(commands, KEY, purpose, step)
            np.testing.assert_array_equal(world.drive(commands, KEY, purpose, step), expected)
        generation = world.drive(commands, KEY, Purpose.WORLD_GENERATION, 20 * step)
        np.testing.assert_array_equal(generation, now.drive(commands, KEY, Purpose.WORLD_GENERATION, 20 * step))
    others = [build_world(name, ROBOT) for name in (f"physics>{worn}@4", f"{worn}>physics@3", "physics>substitute@3")]
    assert len({world.digest, before.digest, after.digest, *(other.digest for other in others)}) == 6
    assert world.changes_at == 3


def test_a_run_is_as_in_the_first_world_until_it_changes(worn):
    plain, changing = evals(world="physics"), evals(world=f"physics>{worn}@4")
    for name in ("evaluated_fitness_world", "fitness_world", "best_fitness"):
        np.testing.assert_array_equal(plain[name][:3], changing[name][:3])
        assert (plain[name][3:] != changing[name][3:]).all()


def test_probes_are_driven_again_when_the_world_has_changed(worn):
    class Counting:
        def __init__(self, world):
            self._world, self.digest, self.repeatable, self.renderable = world, world.digest, True, False
            self.changes_at = getattr(world, "changes_at", None)
            self.evaluation, self.probed = 0, []

        def drive(self, commands, key, purpose, step):
            if purpose is Purpose.WORLD_EVALUATED:
                self.evaluation = step
            if purpose is Purpose.PROBE:
                self.probed.append(self.evaluation)
            return self._world.drive(commands, key, purpose, step)

    for name, expected in (("physics", [0] * 10), (f"physics>{worn}@3", [0] * 10 + [3] * 10)):
        world = Counting(build_world(name, ROBOT))
        run(RunSpec(**SMALL | {"world": name, "record": "full"}), world=world)
        assert world.probed == expected


def test_a_sweep_has_worlds_that_change_in_its_grid(worn):
    file = worn.with_name("wear.yaml")
    worlds = [f"physics>{worn}@{at}" for at in (2, 3)]
    file.write_text(f"name: wear\nrobot: khepera\nseeds: 1\nfixed: {{evaluations: 3}}\ngrid:\n  world: [{', '.join(worlds)}]\n")
    specs = list(ordered_specs(load_sweep(file)))
    assert sorted(spec.world for spec in specs) == worlds
    assert len({spec.run_id for spec in specs}) == 2


def test_neither_a_window_nor_a_restart_leaves_the_numbers_as_they_were():
    plain, none = (evals(approach=name) for name in ("bns", "bns+window=0+restart=0"))
    for name in ("best_fitness", "fitness_world", "training_error", "validation_error"):
        np.testing.assert_array_equal(plain[name], none[name])


@pytest.mark.parametrize("name", ["bns", "bns+ensemble=2"])
def test_a_window_keeps_the_latest_drives_alone(name):
    every, latest = taught(started(name), 9).trainer, taught(started(f"{name}+window=4"), 9).trainer
    for what in ("training", "validation"):
        whole, kept = getattr(every.data, what), getattr(latest.data, what)
        assert 0 < kept.count < whole.count
        np.testing.assert_array_equal(kept.inputs[:, : kept.count], whole.inputs[:, whole.count - kept.count : whole.count])
        np.testing.assert_array_equal(kept.targets[:, : kept.count], whole.targets[:, whole.count - kept.count : whole.count])
    of_four = taught(started(name), 9).trainer.data.training.count - taught(started(name), 5).trainer.data.training.count
    assert latest.data.training.count == of_four
    if name != "bns":
        np.testing.assert_array_equal(latest.times, every.times[:, -latest.data.training.count :])
        assert latest.times.shape[1] == latest.data.training.count
    latest.train()


def test_two_surprises_in_a_row_are_a_change_and_one_is_none():
    surprise = Surprise(2.0)
    assert not any(surprise.changed(9.0) for _ in range(FEWEST - 1))  # nothing is usual yet
    surprise = Surprise(2.0)
    told = [surprise.changed(error) for error in [1.0] * FEWEST + [2.1, 1.0, 2.1, 2.1, 9.0, 9.0]]
    assert told == [False] * FEWEST + [False, False, False, True, False, False]
    assert not Surprise(2.0).changed(float("nan"))


@pytest.mark.parametrize("name", ["bns", "bns+ensemble=2"])
def test_a_restart_begins_with_untrained_networks_and_the_latest_drives(name):
    approach = started(f"{name}+restart=2")
    untrained = approach.trainer.evolution_weights()
    approach._surprise.changed = lambda error: False
    taught(approach, 6).train()
    assert not np.array_equal(approach.trainer.evolution_weights(), untrained)
    approach._surprise.changed = lambda error: True
    whole = approach.trainer.data.training.count
    taught(approach, 1)
    np.testing.assert_array_equal(approach.trainer.evolution_weights(), untrained)
    assert 0 < approach.trainer.data.training.count < whole / 2


def test_a_wheel_that_wears_is_noticed_within_three_drives_and_a_world_that_stays_is_not(worn):
    for world, dropped in (("physics", []), (f"physics>{worn}@20", [21])):
        found = evals(approach="bns+restart=3", world=world, evaluations=26, **LEARNING)["training_patterns"]
        assert [i + 1 for i in range(1, 26) if found[i] < found[i - 1]] == dropped


def test_the_snake_forgets_likewise():
    snake = {"robot": "snake", "task": "two-regions", "evaluations": 9}
    every, latest = (evals(approach=f"bns{more}", **snake)["training_patterns"] for more in ("", "+window=2+restart=2"))
    assert 0 < latest[-1] < every[-1]


@pytest.mark.slow
def test_the_command_line_takes_a_change(bns, worn, tmp_path):
    small = [f"--{key.replace('_', '-')}={value}" for key, value in SMALL.items()]
    more = ("--approach", "bns+window=2+restart=2+informed=0.1+ensemble=2+model=khepera", "--results", tmp_path)
    done = bns("run", "--world", f"physics>{worn}@3", *small, *more)
    assert done.returncode == 0, done.stderr
    refused = bns("run", "--world", f"physics>{worn}@30", *small, *more)
    assert refused.returncode == 2
    assert "changes at evaluation 30; the run has 5 evaluations" in refused.stderr
