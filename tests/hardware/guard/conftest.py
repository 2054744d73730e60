"""A guard in a process of its own, and the robot that it holds."""

import pytest

from bns.hardware.guard.client import Guard

from ..robots_on_the_line import Robot
from .held import HANGS_S, RECIPES


@pytest.fixture
def held(tmp_path):
    """held(link) -> a robot and its guard, in this process."""
    opened = []

    def build(link, silent_s=HANGS_S):
        robot = Robot(link, tmp_path)
        guard = Guard(str(robot.path), RECIPES[link], silent_s, tmp_path / "guard.jsonl")
        opened.append((robot, guard))
        return robot, guard

    yield build
    for robot, guard in opened:
        if guard._control.fileno() >= 0:
            guard.still()
            guard.close()
        else:  # the trial has vanished
            guard._process.kill()
            guard._process.wait(HANGS_S)
        robot.close()
