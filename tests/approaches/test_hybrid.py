"""Physics first, and networks that learn what it gets wrong: ``approach: bns+model=khepera``."""

import numpy as np
import pytest

from bns.approaches import check_networked, start_approach
from bns.approaches.parts.hybrid import Arcs, HybridSimulator
from bns.bootstrap.loop import run
from bns.bootstrap.simulators import PhysicsSimulator
from bns.engine.philox import Key
from bns.errors import BnsError, SpecError
from bns.physics.model import load_model
from bns.robots import load_robot
from bns.robots.base import RandomStream
from bns.spec import RunSpec
from bns.tasks import load_task

SMALL = {"evaluations": 3, "population_size": 20, "generations_per_evaluation": 3, "training_iterations_per_evaluation": 5}
KEY = Key(3, 4)
ROBOT, TASK = load_robot("khepera"), load_task("khepera", "circle")
DRAWING = load_model("khepera")
WRONG = DRAWING.with_effect("wheelbase", factor=1.05).with_effect("wheel-mismatch", ratio=1.02)
SLIPPING = WRONG.with_effect("turn-slip", slip_s=0.01).with_effect("side-slip", slip_s=0.005).with_effect("speed-gain", gain=0.9)


def numbers(approach, **changes):
    evals = run(RunSpec(**SMALL | {"approach": approach} | changes)).tables["evals"]
    return {name: list(evals[name]) for name in ("best_fitness", "fitness_world", "training_error", "driven_ms")}


def started(approach, **changes):
    return start_approach(ROBOT, TASK, KEY, RunSpec(**SMALL | {"approach": approach} | changes))


def drives(count, key=KEY):
    return [ROBOT.random_controllers(key, count, 10).controller(number) for number in range(count)]


@pytest.mark.parametrize("model", [DRAWING, WRONG, SLIPPING], ids=["drawing", "wrong", "slipping"])
def test_an_arc_command_by_command_is_what_integration_gives(model):
    physics, arcs = PhysicsSimulator(ROBOT, TASK, model), Arcs(ROBOT, model)
    for commands in drives(5):
        np.testing.assert_allclose(ROBOT.poses(arcs.displacements(commands)), physics.poses(commands), atol=1e-6)


def test_no_model_leaves_the_numbers_as_they_were_and_a_model_gives_others_by_the_seed():
    assert numbers("bns") == numbers("bns+model=none")
    assert numbers("bns+model=khepera") == numbers("bns+model=khepera") != numbers("bns+model=khepera", seed=1)
    assert numbers("bns+model=khepera") != numbers("bns")


@pytest.mark.parametrize("name", ["bns+model=khepera", "bns+model=khepera+ensemble=2"])
def test_untrained_a_hybrid_is_its_model(name):
    approach, physics = started(name), PhysicsSimulator(ROBOT, TASK, DRAWING)
    commands = drives(1)[0]
    np.testing.assert_allclose(approach.simulator.poses(commands), physics.poses(commands), atol=1e-6)
    np.testing.assert_allclose(approach.evolver.scores.fitness, physics.score(approach.evolver.population).fitness, rtol=1e-5)


@pytest.mark.parametrize("name", ["bns+model=khepera", "bns+model=khepera+ensemble=2"])
def test_where_its_networks_fail_a_hybrid_is_its_model_again(name):
    approach, physics = started(name), PhysicsSimulator(ROBOT, TASK, DRAWING)
    commands = drives(1)[0]
    approach.learn(commands, PhysicsSimulator(ROBOT, TASK, SLIPPING).poses(commands), 1)
    for trainer in getattr(approach.trainer, "members", [approach.trainer]):
        trainer.rule.weights[:] = np.nan
    approach.train()
    approach.copy()
    assert approach.measures()["arithmetic_failures"] == len(ROBOT.networks) * (2 if "ensemble" in name else 1)
    np.testing.assert_allclose(approach.simulator.poses(commands), physics.poses(commands), atol=1e-6)


def test_networks_learn_what_the_model_gets_wrong():
    approach = started("bns+model=khepera", training_iterations_per_evaluation=1000)
    world = PhysicsSimulator(ROBOT, TASK, SLIPPING)
    for number, commands in enumerate(drives(15), 1):
        approach.learn(commands, world.poses(commands), number)
    approach.train()
    approach.copy()
    learned, target = approach.trainer.data.training, ROBOT.measured_displacements(world.poses(drives(1)[0]))
    rest = ROBOT.targets(target - Arcs(ROBOT, DRAWING).displacements(drives(1)[0]))
    assert any(np.allclose(learned.targets[:, 0], column, atol=1e-6) for column in rest.T)
    new = drives(3, Key(5, 6))
    error = {
        name: np.mean([np.abs(simulator.poses(one) - world.poses(one))[:, :2].mean() for one in new])
        for name, simulator in (("hybrid", approach.simulator), ("drawing", PhysicsSimulator(ROBOT, TASK, DRAWING)))
    }
    assert error["hybrid"] < error["drawing"] / 3


def test_what_parents_knew_leaves_scores_as_they_are_and_they_are_those_of_the_paths():
    approach = started("bns+model=khepera")
    approach.learn(drives(1)[0], PhysicsSimulator(ROBOT, TASK, SLIPPING).poses(drives(1)[0]), 1)
    approach.advance()
    evolver, simulator = approach.evolver, approach.simulator
    assert isinstance(simulator, HybridSimulator)
    alone = simulator.score(evolver.population, RandomStream(KEY, evolver.generations))
    np.testing.assert_array_equal(evolver.scores.fitness, alone.fitness)
    paths = [simulator.poses(evolver.population.controller(i)) for i in range(len(evolver.population))]
    np.testing.assert_allclose(alone.fitness, [ROBOT.evaluate_path(path, TASK)[0] for path in paths], rtol=1e-5)


@pytest.mark.parametrize("more", ["ensemble=2+use=worst", "ensemble=2+use=sampled", "informed=0.5", "margin=0.03"])
def test_a_model_goes_with_the_other_options(more):
    longer = {"population_size": 100, "generations_per_evaluation": 30}  # all goals are reached on the model
    assert numbers(f"bns+model=khepera+{more}", **longer) != numbers("bns+model=khepera", **longer)


def test_a_model_may_be_a_file(tmp_path):
    file = tmp_path / "worn.yaml"
    reason = "basis: guess, reason: a test"
    file.write_text(
        "base: differential-drive\nwheelbase_m: 0.0884\n"
        f"effects:\n  - {{name: wheelbase, values: {{factor: 1.05}}, {reason}}}\n"
    )
    assert numbers(f"bns+model={file}") != numbers("bns+model=khepera")


@pytest.mark.parametrize(
    ("approach", "changes", "said"),
    [
        ("bns+model=khepra", {}, r"model is 'khepra'; it must be one of none, khepera, khepera-world, or a file ending"),
        ("bns+model=khepera-world", {}, r"has a memory \(after ten commands \d+ mm; effects: .*motor-lag.*take effects such as"),
        ("bns+model=gone.yaml", {}, r"gone\.yaml"),
        ("bns+model=khepera", {"robot": "snake", "task": "two-regions"}, "a model of two wheels, and the snake has none"),
    ],
)
def test_a_model_that_cannot_be_is_refused(approach, changes, said):
    with pytest.raises(BnsError, match=said):
        run(RunSpec(**SMALL | {"approach": approach} | changes))


def test_networks_that_say_half_of_it_are_not_kept():
    check_networked(RunSpec(approach="bns+ensemble=3"))
    with pytest.raises(SpecError, match="networks that learn only the error of its model; leave --save-snn out"):
        check_networked(RunSpec(approach="bns+model=khepera"))
