"""When estimation-exploration tests, and when controllers evolve."""

import numpy as np
import pytest

from bns.approaches import start_approach
from bns.approaches.estimation_exploration import disagreement
from bns.bootstrap.simulators import PhysicsSimulator
from bns.engine.evolution import Population
from bns.engine.philox import Key
from bns.physics.model import load_model
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task

ROBOT, TASK = load_robot("khepera"), load_task("khepera", "circle")


def test_the_last_test_is_followed_by_evolution_and_only_then_is_the_fittest_driven(monkeypatch):
    small = {"population_size": 4, "generations_per_evaluation": 1, "max_commands": 8, "world": "physics", "evaluations": 4}
    spec = RunSpec(approach="estimation-exploration+tests=0.5+models=4+voters=2+generations=1+candidates=2", **small)
    approach, seen = start_approach(ROBOT, TASK, Key(0, 0), spec), []
    monkeypatch.setattr(approach, "_test", lambda evaluation: f"test {evaluation}")
    monkeypatch.setattr(approach, "fittest", lambda: "fittest")
    monkeypatch.setattr(approach, "plan", lambda controller: controller)
    monkeypatch.setattr(approach, "evolve", lambda: seen.append("evolved"))
    commands = ROBOT.random_controllers(Key(1, 1), 1, 3).controller(0)
    for evaluation in range(1, 5):
        seen.append(approach.pick(evaluation))
        approach.learn(commands, approach.simulator.poses(commands), evaluation)
        approach.advance()
    assert seen == ["test 1", "test 2", "evolved", "fittest", "evolved", "fittest", "evolved"]


def test_the_best_models_choose_the_test_that_they_disagree_on_most(monkeypatch):
    """A stand-in for their disagreement: it is greatest about the third of five candidates."""
    small = {"population_size": 4, "max_commands": 8, "world": "physics", "evaluations": 8}
    options = "+models=6+voters=4+candidates=5+commands=3+tests=0.5"
    approach = start_approach(ROBOT, TASK, Key(0, 0), RunSpec(approach="estimation-exploration" + options, **small))
    asked = []

    def stood_in(simulators, tests):
        asked.append(([simulator.model for simulator in simulators], [tests.controller(i).tolist() for i in range(len(tests))]))
        return np.array([0.1, 0.3, 0.9, 0.0, 0.2])

    monkeypatch.setattr("bns.approaches.estimation_exploration.disagreement", stood_in)
    picked = [approach.pick(evaluation).tolist() for evaluation in (1, 2)]
    best = [approach.models.model(rank) for rank in range(4)]
    for (models, candidates), commands in zip(asked, picked, strict=True):
        assert models == best
        assert [len(one) for one in candidates] == [3] * 5
        assert commands == candidates[2]
    assert not any(one in asked[0][1] for one in asked[1][1])  # each test is one of new candidates


def test_of_models_that_explain_as_much_the_one_with_fewer_effects_has_the_smaller_error():
    """By one percent for each effect; these do nothing."""
    small = {"population_size": 4, "max_commands": 8, "world": "physics", "evaluations": 4}
    approach = start_approach(ROBOT, TASK, Key(0, 0), RunSpec(approach="estimation-exploration+models=4", **small))
    commands, drawing = ROBOT.random_controllers(Key(1, 1), 1, 5).controller(0), load_model("khepera")
    driven = PhysicsSimulator(ROBOT, TASK, drawing.with_effect("speed-gain", gain=0.9)).poses(commands)
    approach.learn(commands, driven, 1)
    idle = drawing.with_effect("wheelbase", factor=1.0).with_effect("wheel-mismatch", ratio=1.0)
    assert approach._error(idle) == pytest.approx(1.02 * approach._error(drawing), rel=1e-9)
    assert approach._error(drawing) > 0


def test_models_disagree_about_the_commands_of_a_test_alone():
    """What a list has behind its end counts for nothing."""
    whole = ROBOT.random_controllers(Key(1, 1), 2, 6)
    cut = Population(whole.commands.copy(), np.array([6, 3], np.int32))
    alone = Population(whole.commands[1:, :3].copy(), np.array([3], np.int32))
    drawing = load_model("khepera")
    simulators = [PhysicsSimulator(ROBOT, TASK, m) for m in (drawing, drawing.with_effect("speed-gain", gain=0.9))]
    assert disagreement(simulators, cut)[1] == pytest.approx(disagreement(simulators, alone)[0])
    assert disagreement(simulators, cut)[0] == pytest.approx(disagreement(simulators, whole)[0])
