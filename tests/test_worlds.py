"""Worlds answer the same question the same way, and another question another way."""

import numpy as np
import pytest

from bns.engine.philox import Key, Purpose
from bns.errors import ModelError, SpecError
from bns.robots import load_robot
from bns.robots.simulator import load_static_simulator
from bns.spec import FIELDS
from bns.worlds import build_world
from bns.worlds.logged import LoggedWorld
from bns.worlds.robot import RobotWorld, in_task_frame

SIMULATED = [name for name in FIELDS["world"].metadata["choices"] if name != "robot"]
KEY = Key.of_run(1, 0, "khepera", "circle")


@pytest.fixture(params=SIMULATED)
def world(request):
    return build_world(request.param, load_robot("khepera"))


@pytest.fixture
def commands():
    return load_robot("khepera").random_controllers(KEY, 1, 6).controller(0)


def test_same_draws_same_poses_and_other_draws_others(world, commands):
    first = world.drive(commands, KEY, Purpose.WORLD_EVALUATED, 1)
    assert first.shape == (6, 3)
    np.testing.assert_array_equal(first, world.drive(commands, KEY, Purpose.WORLD_EVALUATED, 1))
    for key, purpose, step in (
        (KEY, Purpose.WORLD_EVALUATED, 2),
        (KEY, Purpose.WORLD_FITTEST, 1),
        (Key.of_run(2, 0, "khepera", "circle"), Purpose.WORLD_EVALUATED, 1),
    ):
        assert not np.array_equal(first, world.drive(commands, key, purpose, step))


def test_noise_is_small_against_what_a_command_does(world, commands):
    poses = np.array([world.drive(commands, KEY, Purpose.WORLD_EVALUATED, step) for step in range(200)])
    spread = poses[:, 0].std(axis=0)
    assert (spread < [0.02, 0.02, 0.1]).all()
    assert (spread > [1e-3, 1e-3, 1e-3]).all()


def test_shorter_list_is_the_beginning_of_the_longer(world, commands):
    whole = world.drive(commands, KEY, Purpose.WORLD_EVALUATED, 1)
    part = world.drive(commands[:3], KEY, Purpose.WORLD_EVALUATED, 1)
    np.testing.assert_allclose(part, whole[:3], atol=1e-6)  # float32 networks


def test_straight_drive_goes_north(world):
    end = world.drive(np.array([[20000.0, 20000.0, 2000.0]]), KEY, Purpose.WORLD_EVALUATED, 1)[-1]
    assert end[1] == pytest.approx(20000 / 144010 * 2, abs=0.03)
    assert abs(end[0]) < 0.03


def test_worlds_agree_on_the_mean_and_have_other_digests(commands):
    robot = load_robot("khepera")
    worlds = [build_world(name, robot) for name in SIMULATED]
    means = [
        np.mean([w.drive(commands, KEY, Purpose.WORLD_EVALUATED, s)[0] for s in range(300)], axis=0) for w in worlds
    ]
    np.testing.assert_allclose(means[0], means[1], atol=0.02)
    assert worlds[0].digest != worlds[1].digest


def test_shipped_simulator_says_how_accurate_it_is_and_where_it_comes_from():
    simulator = load_static_simulator("khepera")
    made = simulator.provenance
    assert made["world_digest"] == build_world("physics", load_robot("khepera")).digest, "run: bns precompute"
    assert made["verification_patterns"] > 500
    for name in simulator.networks:
        assert made["accuracy"][name]["r2"] > 0.99
        assert abs(made["accuracy"][name]["slope"] - 1) < 0.02
    assert (simulator.noise_sd > 0).all()


def test_a_robot_is_driven_by_a_trial_only():
    with pytest.raises(SpecError, match="Drive it with: bns trial --robot khepera"):
        build_world("robot", load_robot("khepera"))


def test_what_a_robot_did_is_judged_as_if_it_had_begun_at_the_start():
    path = np.array([[0.3, -0.1, 0.4], [0.5, 0.1, 1.0], [0.2, 0.4, 7.5]])
    robot = load_robot("khepera")
    moved = in_task_frame(robot, path)
    step = robot.measured_displacements(moved)
    turn = np.pi / 2 - 0.4
    assert moved[:, 2] == pytest.approx(path[1:, 2] + turn)
    assert np.hypot(*step[0, :2]) == pytest.approx(np.hypot(0.2, 0.2))


def test_a_snake_that_was_laid_down_elsewhere_is_judged_from_the_start_too():
    robot = load_robot("snake")
    did = robot.poses(np.array([[0.1, 0.02, 0.08, 0.0, 1.0], [-0.2, 0.1, 0.0, 0.1, 0.0]]))
    elsewhere = robot.transform(np.vstack([robot.start_pose(), did]), 0.7, np.array([0.2, -0.1]))
    assert abs(elsewhere[1:, :8] - did[:, :8]).min() > 1e-3
    np.testing.assert_allclose(in_task_frame(robot, elsewhere), did, atol=1e-12)


def test_a_robot_drives_nothing_for_the_sake_of_a_measurement():
    with pytest.raises(SpecError, match="it drives what is picked, once"):
        RobotWorld("r").drive(np.zeros((3, 3)), KEY, Purpose.WORLD_FITTEST, 1)
class Filmed:
    """A world that can be rendered."""

    digest, repeatable, renderable = "w-filmed", False, True

    def __init__(self):
        self.pictures = []

    def render(self, commands, picture):
        self.pictures.append((len(commands), picture.name))

    def check_picture(self, picture):
        raise ModelError(f"no {picture.suffix}")


def test_a_logged_world_is_repeatable_and_renderable_as_the_world_behind_it(tmp_path):
    robot, filmed = load_robot("khepera"), Filmed()
    logged = LoggedWorld(filmed, robot)
    assert (logged.repeatable, logged.renderable) == (False, True)
    logged.render(np.zeros((3, 3)), tmp_path / "a.png")
    assert filmed.pictures == [(3, "a.png")]
    with pytest.raises(ModelError, match=r"no \.gif"):
        logged.check_picture(tmp_path / "a.gif")
    assert not build_world("physics", robot).renderable
    assert build_world("physics", load_robot("snake")).renderable
