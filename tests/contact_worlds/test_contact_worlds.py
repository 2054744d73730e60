"""The generator repeats itself, and its worlds with nothing hidden move as the ideal law says."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from tests.contact_worlds.catalogue import FORMATS, HEADER, worlds
from tests.contact_worlds.simulation import ROW_S, simulate

NOTHING = [world for world in worlds() if world.kind == "none"]


def ideal(start: np.ndarray, wheels: np.ndarray, wheelbase: float) -> np.ndarray:
    """Poses at the rows' times if each wheel turned as commanded from the row's time on."""
    poses = [start]
    for left, right in wheels[:-1]:
        x, y, heading = poses[-1]
        turn = (right - left) / wheelbase * ROW_S
        step = (left + right) / 2 * ROW_S * np.sinc(turn / 2 / np.pi)
        poses.append(
            np.array([x + step * np.cos(heading + turn / 2), y + step * np.sin(heading + turn / 2), heading + turn])
        )
    return np.array(poses)


def test_the_same_seed_gives_the_same_log():
    setup = worlds()[-1].setup
    first, again, other = (simulate(setup, [seed], trials=2, rows=20)[0] for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    assert first.shape[1] == len(FORMATS) == len(HEADER.split(","))


@pytest.mark.parametrize("world", NOTHING, ids=lambda world: world.name)
def test_with_nothing_hidden_the_robot_follows_the_ideal_law(world):
    rows = 41
    log, true = simulate(world.setup, [1], trials=4, rows=rows)
    for begin in range(0, len(log), rows):
        pose = true[begin : begin + rows]
        error = pose - ideal(pose[0], log[begin : begin + rows, 5:], world.setup.robot.wheelbase_m)
        assert np.hypot(error[:, 0], error[:, 1]).max() < 0.006
        assert abs(error[:, 2]).max() < np.deg2rad(2)
        assert np.hypot(*(log[begin : begin + rows, 2:4] - pose[:, :2]).T).max() < 0.006


def test_names_differ_and_each_world_tells_what_it_hides():
    every = worlds()
    assert len({world.name for world in every}) == len(every)
    assert all(bool(world.hidden) == bool(world.expected) == (world.kind != "none") for world in every)
