"""The snake in physics: its gait, where it goes, why a cycle counts as unstable."""

import math
from dataclasses import replace
from importlib import resources

import mujoco
import numpy as np
import pytest

from bns.engine.philox import Key, Purpose
from bns.errors import ModelError
from bns.physics.snake.body import Body
from bns.physics.snake.gait import cycle_angles
from bns.physics.snake.parameters import read_parameters, shipped_parameters
from bns.physics.snake.stability import BLEW_UP, COLLISION, STALLED, TIPPED, mean_roll_rad
from bns.physics.snake_drive import SnakePhysics, build
from bns.robots import load_robot

KEY = Key(1, 2)
SIDEWINDING = [0.6, 0.3, math.pi / 3, 1.5 * math.pi]
ROLLING = [1.43, 1.26, 3.81, 4.58]
FALLING, ROLLING_ROUND = [0.85, 0.79, 5.18, 1.41], [0.86, 0.55, 4.6, 0.39]
"""One leaves the robot on its side, the other goes right round and ends upright."""


@pytest.fixture(scope="module")
def body():
    return Body(shipped_parameters())


def laid(body):
    body.lay_straight()
    return body


def sideways_and_along(driven):
    """Displacement of both markers (2, 2) to the right of, and along, the line from yellow to green."""
    along = np.subtract(*driven.before_m[::-1])
    along = along / np.linalg.norm(along)
    return (driven.after_m - driven.before_m) @ np.array([[along[1], along[0]], [-along[0], along[1]]])


def test_angles_are_those_of_the_equations_written_out():
    a_lat, a_vert, omega, alpha = 1.1, 0.7, 2.3, 0.4
    angles = cycle_angles([a_lat, a_vert, omega, alpha])
    for t in range(13):
        for n in range(12):
            theta = omega * n + 2 * math.pi / 12 * t
            expected = a_lat * math.sin(theta + alpha) if n % 2 == 0 else a_vert * math.sin(theta)
            assert angles[t, n] == pytest.approx(expected, abs=1e-12)
    np.testing.assert_allclose(angles[0], angles[12], atol=1e-12)


@pytest.mark.parametrize("cycle", [[0.5, 0.6, 1, 1], [0.5, 0.5, 1, 1], [1.6, 0.1, 1, 1], [0.5, -0.1, 1, 1]])
def test_amplitudes_that_break_the_rule_are_refused(cycle):
    with pytest.raises(ModelError, match=r"a_lat_rad = .* a_vert_rad = .* 0 <= a_vert_rad < a_lat_rad <= pi/2"):
        cycle_angles(cycle)


def test_a_cycle_that_is_not_finite_is_refused():
    with pytest.raises(ModelError, match="four finite numbers: a_lat_rad, a_vert_rad, omega_rad, alpha_rad"):
        cycle_angles([0.5, 0.1, np.nan, 1])


def test_the_model_has_the_body_that_the_parameters_say(body):
    p = shipped_parameters()
    assert body.model.nu == p.joints == 12
    assert body.model.body_mass.sum() == pytest.approx(p.body_mass_kg + p.tail_mass_kg)
    body.lay_straight((0.3, 0.0), 0.0)
    np.testing.assert_allclose(body.markers_m(), [[-0.025, 0.0], [0.625, 0.0]], atol=1e-9)
    body.lay_straight((0.3, 0.1), math.pi / 2)
    np.testing.assert_allclose(body.markers_m(), [[0.3, -0.225], [0.3, 0.425]], atol=1e-9)


def test_without_amplitudes_it_lies_still(body):
    driven = laid(body).drive_cycle([0, 0, 1, 1])
    assert driven.causes == ()
    assert np.abs(driven.after_m - driven.before_m).max() < 1e-3


def test_side_winding_goes_sideways_and_its_mirror_image_the_other_way(body):
    moved = sideways_and_along(laid(body).drive_cycle(SIDEWINDING))
    assert (np.abs(moved[:, 0]) > 0.05).all()
    assert (np.abs(moved[:, 0]) < 0.30).all()
    assert (np.abs(moved[:, 1]) < 0.05).all()
    mirrored = sideways_and_along(laid(body).drive_cycle([*SIDEWINDING[:3], math.pi / 2]))
    np.testing.assert_allclose(mirrored, moved * [-1, 1], atol=2e-3)


def test_same_drive_twice_is_the_same(body):
    first = laid(body).drive_cycle(SIDEWINDING)
    body.drive_cycle(ROLLING)
    np.testing.assert_array_equal(laid(body).drive_cycle(SIDEWINDING).after_m, first.after_m)


@pytest.mark.parametrize(
    ("cycle", "causes"),
    [
        (SIDEWINDING, ()),
        (ROLLING, (TIPPED,)),
        ([1.56, 0.96, 5.96, 2.89], (COLLISION,)),
        ([1.13, 0.21, 3.3, 1.95], (COLLISION, STALLED)),
    ],
)
def test_causes_of_instability_are_named(body, cycle, causes):
    assert laid(body).drive_cycle(cycle).causes == causes


def test_the_named_posture_is_the_one_the_body_is_in(body):
    rolls = []
    laid(body).drive_cycle(ROLLING, lambda _, data: rolls.append(mean_roll_rad(data.xmat[1:].reshape(-1, 3, 3))))
    assert max(np.abs(rolls)) > shipped_parameters().tipped_rad
    rolls.clear()
    laid(body).drive_cycle(SIDEWINDING, lambda _, data: rolls.append(mean_roll_rad(data.xmat[1:].reshape(-1, 3, 3))))
    assert max(np.abs(rolls)) < 0.7


def test_stronger_servos_no_longer_stall():
    weak = replace(shipped_parameters(), torque_limit_n_m=0.3)
    assert STALLED in laid(Body(weak)).drive_cycle([1.2, 0.8, 1.0, 1.0]).causes
    strong = replace(shipped_parameters(), torque_limit_n_m=15.0)
    assert STALLED not in laid(Body(strong)).drive_cycle([1.2, 0.8, 1.0, 1.0]).causes


def test_physics_that_blows_up_is_an_unstable_cycle_and_the_next_drive_is_sound():
    world = SnakePhysics(shipped_parameters())

    def explode(_, data):
        if data.time > 0.3:
            data.qvel[:] = np.nan

    commands = np.array([SIDEWINDING, SIDEWINDING])
    seen = world.drive(commands, KEY, Purpose.WORLD_EVALUATED, 1, explode)
    assert seen.shape == (1, 9)
    assert np.isfinite(seen).all()
    assert seen[0, 8] == 0
    assert BLEW_UP in world.causes[0]
    assert world.drive(commands, KEY, Purpose.WORLD_EVALUATED, 1)[:, 8].tolist() == [1, 1]


def stability_of(cycles, **changed):
    world = SnakePhysics(replace(shipped_parameters(), **changed))
    return world.drive(np.array(cycles), KEY, Purpose.WORLD_EVALUATED, 1)[:, 8].tolist()


def test_a_robot_on_its_side_is_not_driven_on():
    world = SnakePhysics(shipped_parameters())
    seen = world.drive(np.array([SIDEWINDING, FALLING, SIDEWINDING]), KEY, Purpose.WORLD_EVALUATED, 1)
    assert seen[:, 8].tolist() == [1, 0]
    assert [bool(causes) for causes in world.causes] == [False, True]


def test_a_robot_that_rolled_and_stands_again_is_driven_on_unless_read_otherwise():
    cycles = [SIDEWINDING, ROLLING_ROUND, SIDEWINDING]
    assert stability_of(cycles) == [1, 0, 1]
    assert stability_of(cycles, tipped_on_the_way_ends=1.0) == [1, 0]
    assert stability_of(cycles, tipped_on_the_way_fails=0.0) == [1, 1, 1]
    assert stability_of([SIDEWINDING, FALLING, SIDEWINDING], tipped_on_the_way_fails=0.0) == [1, 0]


def test_a_robot_on_its_side_is_driven_on_with_exchanged_roles_where_read_so(body):
    assert len(stability_of([FALLING, SIDEWINDING, SIDEWINDING], roles_switch_on_side=1.0)) == 3
    lying = Body(replace(shipped_parameters(), roles_switch_on_side=1.0))
    for one, switched in ((lying, True), (body, False)):
        one.lay_straight()
        one.data.qpos[3:7] = [math.cos(math.pi / 4), math.sin(math.pi / 4), 0, 0]  # on its side
        mujoco.mj_forward(one.model, one.data)
        one.drive_cycle([0.5, 0.0, 0.0, math.pi / 2])
        bent = np.abs(one.data.qpos[7:])
        assert bent[int(switched) :: 2].mean() > 3 * bent[int(not switched) :: 2].mean()


def test_the_heavy_end_is_yellows_unless_read_otherwise(body):
    green = Body(replace(shipped_parameters(), tether_at_yellow=0.0))
    masses = [one.model.body_mass[1:] for one in (body, green)]
    tail = shipped_parameters().tail_mass_kg
    assert masses[0][0] - masses[0][1] == pytest.approx(tail)
    np.testing.assert_allclose(masses[0], masses[1][::-1])
    moved = [np.abs(sideways_and_along(laid(one).drive_cycle(SIDEWINDING))[:, 0]) for one in (body, green)]
    assert moved[0][0] < moved[0][1]
    assert moved[1][0] > moved[1][1]
    with pytest.raises(ModelError, match=r"tether_at_yellow is 0.5; it is a reading: give 1 \(yes\) or 0 \(no\)"):
        replace(shipped_parameters(), tether_at_yellow=0.5)


def test_a_robot_slips_down_a_floor_that_falls_and_friction_differs_from_link_to_link(body):
    ends = []
    for tilt in (0.05, -0.05):
        laid(body).set_tilt(0.0, tilt)
        ends.append(body.drive_cycle(SIDEWINDING).after_m.mean(axis=0)[1])
    body.set_tilt(0.0, 0.0)
    assert ends[0] - ends[1] > 0.02
    even = laid(body).drive_cycle(SIDEWINDING).after_m
    body.set_friction(np.linspace(0.3, 1.7, 13))
    uneven = laid(body).drive_cycle(SIDEWINDING).after_m
    body.set_friction(1.0)
    assert np.abs(uneven - even).max() > 0.005
    np.testing.assert_array_equal(laid(body).drive_cycle(SIDEWINDING).after_m, even)


def test_same_draws_same_drive_and_friction_differs_from_cycle_to_cycle():
    world, commands = SnakePhysics(shipped_parameters()), np.array([SIDEWINDING] * 2)
    first = world.drive(commands, KEY, Purpose.WORLD_EVALUATED, 1)
    np.testing.assert_array_equal(first, world.drive(commands, KEY, Purpose.WORLD_EVALUATED, 1))
    other = world.drive(commands, KEY, Purpose.WORLD_EVALUATED, 2)
    assert 1e-4 < np.abs(other - first)[:, 4:8].max() < 0.05
    np.testing.assert_allclose(first[0, :4], [-0.025, 0.0, 0.625, 0.0], atol=0.1)


def test_a_file_of_parameters_makes_another_world(tmp_path):
    robot, text = load_robot("snake"), (resources.files("bns.physics.snake") / "parameters.yaml").read_text()
    (tmp_path / "ice.yaml").write_text(text.replace("{value: 0.25,", "{value: 0.05,"))
    (tmp_path / "half.yaml").write_text(text[: len(text) // 2].rsplit("\n", 1)[0])
    assert build(robot, str(tmp_path / "ice.yaml")).digest != build(robot).digest
    with pytest.raises(ModelError, match=r"lack .*floor_friction"):
        build(robot, str(tmp_path / "half.yaml"))
    with pytest.raises(ModelError, match=r"cannot read .*none\.yaml: No such file"):
        build(robot, str(tmp_path / "none.yaml"))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"links": 13.5}, "links is 13.5; it must be a whole number"),
        ({"marker_gap_m": 1.2}, r"marker_gap_m is 1.2; it must be less than the body's length, links times pitch_m = 1.14"),
        ({"radius_m": 0.05}, "pitch_m must be more than twice radius_m"),
    ],
)
def test_numbers_that_are_no_body_together_are_refused(changed, message):
    with pytest.raises(ModelError, match=message):
        replace(shipped_parameters(), **changed)


def test_files_that_are_no_text_or_no_yaml_are_refused(tmp_path):
    (tmp_path / "latin.yaml").write_bytes("links: 13 # Länge".encode("latin-1"))
    (tmp_path / "open.yaml").write_text("links: {value: 13")
    for name, message in (("latin", "is not UTF-8 text"), ("open", "no valid YAML.*Look at indentation")):
        with pytest.raises(ModelError, match=f"(?s){message}"):
            build(load_robot("snake"), str(tmp_path / f"{name}.yaml"))


def test_parameters_say_what_is_wrong_with_them():
    good = "floor_friction: {value: 0.35, basis: guess, reason: x}"
    for text, message in (
        (good, "lack links, pitch_m"),
        ("friction: {value: 1, basis: guess, reason: x}", "unknown parameter of the snake 'friction'.*Did you mean"),
        ("floor_friction: 0.3", "floor_friction is 0.3; it needs value, basis and reason"),
        (good.replace("guess", "hearsay"), "unknown basis of the snake's floor_friction 'hearsay'"),
    ):
        with pytest.raises(ModelError, match=message):
            read_parameters(text)
    with pytest.raises(ModelError, match=r"floor_friction.*-1"):
        replace(shipped_parameters(), floor_friction=-1.0)
    assert replace(shipped_parameters(), floor_friction=0.3).digest != shipped_parameters().digest
