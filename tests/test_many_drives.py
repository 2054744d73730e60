"""Drives on several cores: the same numbers, in the same order, as one after the other."""

import numpy as np

from bns.engine.philox import Key, Purpose
from bns.robots import load_robot
from bns.worlds import build_world
from bns.worlds.many import drive_all

ROBOT, KEY = load_robot("snake"), Key(2, 9)


def test_any_number_of_jobs_drives_the_same():
    commands = ROBOT.random_controllers(KEY, 1, 12).controller(0)
    alone = [commands[i : i + 1] for i in range(len(commands))]
    told = []
    one = drive_all(build_world("physics", ROBOT), alone, KEY, Purpose.PRECOMPUTE, 5, 1)
    two = drive_all(build_world("physics", ROBOT), alone, KEY, Purpose.PRECOMPUTE, 5, 2, told.append)
    np.testing.assert_array_equal(np.vstack(one), np.vstack(two))
    assert told == [10, 12]
    later = drive_all(build_world("physics", ROBOT), alone[3:4], KEY, Purpose.PRECOMPUTE, 8)
    np.testing.assert_array_equal(later[0], one[3])
