"""A controller driven in the substitute world, what is judged of it and what is learnt, against the CPU engine."""

import numpy as np
import pytest

from bns.engine.evolution import pick
from bns.engine.patterns import TrainingData
from bns.engine.philox import Purpose
from bns.engine.snn import predict
from bns.robots.simulator import load_static_simulator
from bns.tasks import Task
from bns.worlds import build_world
from tests.gpu.arrays import KEY, Arrays


def drive(robot, learning, **changes):
    """The run, and the same as `bns.bootstrap.loop` and `bns.bootstrap.recorder` would: row, patterns."""
    one = Arrays(robot, size=4, generations_per_evaluation=0, **changes)
    one.evolve(0)
    static, purpose = load_static_simulator(robot), Purpose.WORLD_EVALUATED if learning else Purpose.WORLD_FITTEST
    order, cdf = one.first(one.order), one.first(one.cdf)
    who = pick(KEY, Purpose.PICK, 2, order, cdf) if learning else int(order[0])
    weights = one.weights[0]
    planned = one.robot.plan(one.start.controller(who), weights, one.task)
    poses = build_world("substitute", one.robot).drive(planned, KEY, purpose, 2)
    seen = predict(weights, one.robot.inputs(planned), one.robot.sigmoid_output)
    fitness, goals = one.robot.evaluate_path(poses, one.task)
    simulated = one.robot.evaluate_path(one.robot.poses(one.robot.displacements(seen), planned), one.task)[0]
    expected = {
        "fitness_simulation": simulated, "fitness_world": fitness, "goals_reached": goals, "commands": len(planned),
        "driven_ms": one.robot.driven_ms(planned), "success": float(one.robot.succeeded(poses, one.task)),
    }  # fmt: skip
    within = zip(one.robot.radii_m, one.robot.successes(poses, one.task), strict=True)
    expected |= {f"{100 * radius:.0f}cm": float(ok) for radius, ok in within}
    data, moved = TrainingData.empty(5, len(one.robot.networks)), one.robot.measured_displacements(poses)
    learned = one.robot.inputs(planned), one.robot.targets(moved), KEY, 2, one.robot.learnable(moved)
    assert data.add(*learned) == 0
    return one, one.drive(2, purpose, learning, static.weights, static.noise_sd), expected, data


@pytest.mark.parametrize("robot", ["khepera", "snake"])
def test_the_fittest_is_driven_as_on_the_cpu_and_teaches_nothing(robot):
    one, row, expected, _ = drive(robot, False)
    assert row == pytest.approx(expected, rel=1e-5)
    assert one.counts.ravel().tolist() == [0, 0]


def test_a_snake_is_driven_as_far_as_simulation_needs_it():
    hall = Task("hall", "one large region", "", np.array([[0.3, 0.0]]), 4.0, (9.0, 9.0))
    one, row, expected, _ = drive("snake", False, task=hall)
    assert row == pytest.approx(expected, rel=1e-5)
    assert (row["success"], row["commands"], one.used[0, 0]) == (1, 1, 1)


@pytest.mark.parametrize("robot", ["khepera", "snake"])
def test_the_winner_of_the_tournament_is_driven_and_what_it_does_is_learnt(robot):
    one, row, expected, data = drive(robot, True, share=0.5)
    assert row == pytest.approx(expected, rel=1e-5)
    for which, patterns in enumerate((data.training, data.validation)):
        n = int(one.counts[which, 0])
        assert n == patterns.count > 0
        np.testing.assert_allclose(one.X[which, 0, :, :n], patterns.inputs[:, :n], rtol=1e-6, atol=1e-6)
        absent = np.isnan(one.targets[which, 0, :, :n])
        np.testing.assert_array_equal(~absent, patterns.present[:, :n])
        np.testing.assert_allclose(one.targets[which, 0, :, :n][~absent], patterns.targets[:, :n][~absent], rtol=1e-5, atol=1e-6)
