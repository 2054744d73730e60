"""What the snake's simulator can do beyond the source: changes between cycles, and markers on one body."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bns.bootstrap.loop import run
from bns.engine.philox import Key, Purpose, normals
from bns.engine.snn import predict
from bns.errors import SpecError
from bns.physics.snake.body import Body
from bns.physics.snake.parameters import shipped_parameters
from bns.physics.snake_drive import SnakePhysics
from bns.robots import load_robot
from bns.robots.base import RandomStream
from bns.robots.snake import cycles, path, posture
from bns.robots.snake.gait import joint_angles
from bns.robots.snake.robot import NOISE_SD_M, NOISY_EVALUATIONS
from bns.spec import RunSpec
from bns.tasks import load_task, task_names
from tests.robots.test_snake import networks

KEY, TASK = Key(4, 2), load_task("snake", "three-regions")
PLAIN = load_robot("snake")
VARIANTS = ("snake", "snake+changes", "snake+rigid", "snake+changes+rigid")
SOME = PLAIN.random_controllers(KEY, 1, 30).controller(0)


def gaps(points):
    return np.hypot(*(points.reshape(-1, 2, 2)[:, 1] - points.reshape(-1, 2, 2)[:, 0]).T)


def test_the_links_stand_as_those_of_the_physics_model_do():
    """MuJoCo's kinematics are the independent twin: all distances between links and markers agree."""
    body = Body(shipped_parameters())
    links, markers, _ = posture._shape(joint_angles(SOME[:, :4]))
    for i, cycle in enumerate(SOME):
        body.lay_straight()
        body.data.qpos[7:] = joint_angles(cycle[:4])
        mujoco.mj_kinematics(body.model, body.data)
        theirs = body.data.geom_xpos[1:]
        for ours, same in ((links[i], theirs), (np.vstack([links[i], markers[i]]), np.vstack([theirs, body.data.site_xpos]))):
            apart = [np.linalg.norm(points[:, None] - points[None], axis=2) for points in (ours, same)]
            np.testing.assert_allclose(*apart, atol=2e-4 if len(ours) == 13 else 0.051)  # markers lie on top of the links


def test_a_change_to_the_same_posture_moves_nothing_and_the_straight_body_is_as_it_was_laid():
    again = posture.changes(np.repeat(SOME[:1], 3, axis=0))
    np.testing.assert_allclose(again[1:, :4], 0, atol=1e-9)
    assert again[0, :4].any()
    still = posture.changes(np.zeros((2, 5)))
    np.testing.assert_allclose(still, [[0, 0, 0, 0, 0.65]] * 2, atol=1e-9)


def test_a_mirrored_change_goes_to_the_other_side():
    mirrored = SOME.copy()
    mirrored[:, 3] += np.pi  # lateral angles change their sign
    ours, theirs = posture.changes(SOME), posture.changes(mirrored)
    np.testing.assert_allclose(theirs, ours * [-1, 1, -1, 1, 1], atol=1e-4)


def test_what_was_driven_before_decides():
    before = np.array([-1, 0, 0, 2, -1])
    chosen = posture.changes(SOME[:5], before)
    np.testing.assert_allclose(chosen[2], posture.changes(SOME[[0, 2]])[1])
    np.testing.assert_allclose(chosen[4], posture.changes(SOME[4:5])[0])


@pytest.mark.parametrize("name", VARIANTS)
def test_rollouts_are_their_twins_with_every_option(name):
    robot, weights = load_robot(name), networks()
    population = robot.initial_population(KEY, 30, 4, 100)
    scores = robot.score(population, weights, TASK, RandomStream(KEY, 3))
    rows = normals(KEY, Purpose.ROLLOUT_NOISE, 3, NOISY_EVALUATIONS, 40) * NOISE_SD_M
    for i in range(30):
        in_full = cycles.in_full(population.controller(i))
        moved, worth = robot.displacements(predict(weights, robot.inputs(in_full), True)), []
        for row in rows:
            noisy = moved.copy()
            noisy[:, :4] += row[: len(moved)]
            worth.append(robot.evaluate_path(robot.poses(noisy, in_full), TASK)[0])
        assert scores.fitness[i] == pytest.approx(np.mean(worth), rel=1e-4)


def test_rigid_markers_stay_apart_as_they_were_and_go_where_they_would():
    moved = np.column_stack([np.random.default_rng(0).normal(0, 0.1, (6, 4)), np.ones(6)])
    free, rigid = path.walk(moved[:1]), path.walk(moved[:1], rigid=True)
    np.testing.assert_allclose(path.middles(rigid), path.middles(free))
    np.testing.assert_allclose(gaps(path.walk(moved, rigid=True)[:, 4:8]), 0.65)
    assert np.abs(gaps(path.walk(moved)[:, 4:8]) - 0.65).max() > 0.05
    both = load_robot("snake+changes+rigid").poses(moved, SOME[:6])
    np.testing.assert_allclose(gaps(both[:, 4:8]), posture.changes(SOME[:6])[:, 4])


def test_changes_of_a_body_that_drags_evenly_are_foreseen_better_than_by_nothing():
    world, off = SnakePhysics(replace(shipped_parameters(), tail_mass_kg=0.0, tether_drag_n=0.0)), []
    robot = load_robot("snake+changes+rigid")
    wide = load_robot("snake+sorted-amplitudes").random_controllers(KEY, 1, 30).controller(0)
    for i, gentle in enumerate(wide.reshape(-1, 3, 5) * [0.6, 0.4, 1, 1, 1]):
        seen = world.drive(gentle, KEY, Purpose.PROBE, i + 1)
        for before, after, change in zip(seen[:-1], seen[1:], robot.changes(gentle)[1:], strict=False):
            if before[8] and after[8]:
                told = path.moved_on(before[4:8].reshape(2, 2), change)
                off.append([np.hypot(*(after[:4].reshape(2, 2) - one).mean(axis=0)) for one in (before[4:8].reshape(2, 2), told)])
                assert np.ptp([gaps(after[:4])[0], change[4]]) < 0.03
    without, with_changes = np.sqrt(np.mean(np.square(off), axis=0))
    assert len(off) >= 10
    assert with_changes < 0.9 * without


def test_options_share_tasks_and_luck_and_default_specs_keep_their_names():
    spec = {"task": "two-regions", "population_size": 8, "evaluations": 1, "generations_per_evaluation": 1}
    assert RunSpec(robot="snake", task="two-regions").run_id == "r258b5dbc3d0bd9819d21"
    assert task_names("snake+rigid") == task_names("snake")
    plain, rigid = (run(RunSpec(robot=name, training_iterations_per_evaluation=5, **spec)) for name in ("snake", "snake+rigid"))
    assert plain.tables["evals"]["evaluation"].tolist() == rigid.tables["evals"]["evaluation"].tolist()
    assert RunSpec(robot="snake", **spec).run_id != RunSpec(robot="snake+rigid", **spec).run_id
    np.testing.assert_array_equal(plain.weights.shape, rigid.weights.shape)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("snake+rigd", r"unknown option of robot snake 'rigd'. Did you mean 'rigid'\? Valid: changes, crossover-80, .*rigid"),
        ("snake+rigid+changes", r"in alphabetical order: snake\+changes\+rigid"),
        ("snake+rigid+rigid", r"each option once.*: snake\+rigid"),
        ("khepera+rigid", r"unknown option of robot khepera 'rigid'.* Valid: cuts-inside, exact-durations, flat-spot, .*"),
        ("snek+rigid", "unknown robot 'snek'. Did you mean 'snake'"),
    ],
)
def test_options_that_do_not_exist_are_refused(name, message):
    with pytest.raises(SpecError, match=message):
        load_robot(name)


def test_changes_cannot_be_left_out_in_silence():
    with pytest.raises(ValueError, match="needs the cycles"):
        load_robot("snake+changes").poses(np.ones((1, 5)))
