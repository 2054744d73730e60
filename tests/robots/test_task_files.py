"""What a task file may say, and what is said of one that is wrong; what a Khepera is asked to try beside its populations."""

from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from bns.engine.philox import Key, Purpose, uniforms
from bns.errors import SpecError
from bns.registry import Part
from bns.robots import load_robot
from bns.tasks import TASKS, Task, default_task, load_task, task_names, task_of

SURFACE_M = [2.0, 1.0]


def content(*goals, region_m=0.2, **more):
    return {"title": "t", "source": "s", "goals_m": list(goals), "region_m": region_m, "surface_m": SURFACE_M, **more}


def test_a_goal_that_reaches_the_edge_is_on_the_surface():
    task = task_of("near", content([0.9, 0.4], [-0.9, -0.4]))
    assert (task.region_m, task.surface_m) == (0.2, (2.0, 1.0))
    assert task.goals_m.tolist() == [[0.9, 0.4], [-0.9, -0.4]]
    with pytest.raises(ValueError, match="read-only"):
        task.goals_m[0] = 0.0


@pytest.mark.parametrize("goal", [[0.95, 0.0], [-0.95, 0.0], [0.0, 0.45], [0.0, -0.45]])
def test_the_first_goal_that_reaches_beyond_is_named(goal):
    x, y = goal
    with pytest.raises(SpecError) as refused:
        task_of("far", content([0.6, 0.3], goal, [5.0, 5.0]))
    assert str(refused.value) == (
        f"task far: the goal at ({x:g}, {y:g}) m, 0.2 m wide, reaches outside the surface of 2 m by 1 m around the origin; "
        "move it inside or enlarge surface_m."
    )


def test_a_task_without_surface_has_room_for_any_goal():
    plain = {"title": "t", "source": "s", "goals_m": [[1e6, -1e6]]}
    assert task_of("wide", plain).region_m == 0.0


@pytest.mark.parametrize(("robot", "half_m"), [("khepera", 0.07), ("snake", None)])
def test_goals_become_narrower_until_nothing_is_left(robot, half_m):
    found = load_task(robot, default_task(robot))
    half_m = half_m or found.region_m / 2
    less = found.narrower(half_m / 4, 0.07)
    left = less.region_m / 2 if found.region_m else less.radius_m
    assert left == pytest.approx(half_m * 3 / 4)
    for margin_m in (half_m, 2 * half_m):
        with pytest.raises(SpecError) as refused:
            found.narrower(margin_m, 0.07)
        assert str(refused.value) == (
            f"task {found.name}: a margin of {margin_m:g} m leaves nothing of goals that reach {half_m:g} m; "
            f"take less than {half_m:g}."
        )


@pytest.mark.parametrize("name", ["aaa", "zzz"])
def test_an_entry_point_must_be_called_as_its_task(name):
    task = Task(name, "t", "s", np.zeros((1, 2)))
    assert TASKS._checked(Part(f"khepera.{name}", "x"), task) is task
    with pytest.raises(SpecError, match=rf"it calls itself '{name}'; the entry point must be called ROBOT.{name}"):
        TASKS._checked(Part("khepera.mmm", "x"), task)
    with pytest.raises(SpecError, match=r"it is no bns.tasks.Task, and no package with a file mmm.yaml"):
        TASKS._checked(Part("khepera.mmm", "x"), SimpleNamespace(name="mmm"))


def test_a_package_with_a_file_of_that_name_is_a_task(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "rink").mkdir()
    (tmp_path / "rink" / "__init__.py").touch()
    (tmp_path / "rink" / "ring.yaml").write_text("title: Größe\nsource: s\ngoals_m: [[0.1, 0.2], [0.3, 0.4]]\n", encoding="utf-8")
    task = TASKS._checked(Part("khepera.ring", "x"), import_module("rink"))
    assert (task.name, task.title, task.goals_m.tolist()) == ("ring", "Größe", [[0.1, 0.2], [0.3, 0.4]])


def test_an_entry_point_that_names_no_robot_is_told_how_to_be_called():
    with pytest.raises(SpecError, match=r"it calls itself 'ring'; the entry point must be called ROBOT\.ring"):
        TASKS._checked(Part("hoop", "x"), Task("ring", "t", "s", np.zeros((1, 2))))


def test_every_task_goes_by_its_own_name():
    for robot in ("khepera", "snake"):
        assert [load_task(robot, name).name for name in task_names(robot)] == list(task_names(robot))


def test_a_khepera_is_two_wheels_and_takes_commands_of_a_millisecond_to_a_minute():
    khepera = load_robot("khepera")
    assert khepera.two_wheeled
    assert not khepera.marks_unstable
    assert khepera.given_columns == {
        "left_m_s": (-0.3, 0.3),
        "right_m_s": (-0.3, 0.3),
        "duration_s": (0.001, 60.0),
    }
    assert khepera.radii_m == (0.07, 0.1, 0.14, 0.2)


def test_probes_are_spread_evenly_over_what_a_command_may_be():
    khepera, key = load_robot("khepera"), Key(3, 5)
    low, high = khepera.bounds.low.astype(float), khepera.bounds.high.astype(float)
    u = uniforms(key, Purpose.PROBE, 0, 40, 6)[..., :3].astype(float)
    found = khepera.random_controllers(key, 40, 6)
    np.testing.assert_allclose(found.commands, low + u * (high - low), rtol=1e-5, atol=1e-3)
    assert found.lengths.tolist() == [6] * 40


def test_a_perturbed_command_moves_by_its_span_at_most_and_stays_possible():
    khepera, key = load_robot("khepera"), Key(3, 5)
    low, high, span = (np.asarray(x, float) for x in (khepera.bounds.low, khepera.bounds.high, khepera.bounds.mutation_span))
    commands = np.linspace(low, high, 30)
    u = uniforms(key, Purpose.PROBE, 2, 1, 30)[0, :, :3].astype(float)
    expected = np.clip(commands + span * (2 * u - 1), low, high)
    np.testing.assert_allclose(khepera.perturb(commands, key, 2), expected, rtol=1e-5, atol=1e-2)
    assert (expected != commands).any(axis=0).all()
