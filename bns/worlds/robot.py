"""The robot world: what a robot really did. A trial drives it; nothing else can be asked of it."""

from __future__ import annotations

import numpy as np

from bns.engine.philox import Key, Purpose
from bns.errors import SpecError
from bns.robots.base import Robot, on_floor, rotate


class RobotWorld:
    """The world of a trial, in whose loop a driver of its own has the robot."""

    repeatable = False
    renderable = False

    def __init__(self, digest: str) -> None:
        self.digest = digest

    def drive(self, commands: np.ndarray, key: Key, purpose: Purpose, step: int) -> np.ndarray:
        """Always SpecError: robot time is spent on controllers that are picked, once each."""
        raise SpecError(f"a robot has not driven these {len(commands)} commands; it drives what is picked, once.")


def in_task_frame(robot: Robot, poses: np.ndarray) -> np.ndarray:
    """Tracked poses (n + 1, columns) moved so that the first lies on the task's start; the others, (n, columns).

    An operator puts a robot down within centimetres and degrees; what the networks learn is what it did from there.
    """
    was, start = (on_floor(robot, pose)[0] for pose in (poses[:1], robot.start_pose()))
    turn_rad = start[2] - was[2]
    return robot.transform(poses[1:], turn_rad, start[:2] - rotate(was[None, :2], turn_rad)[0])


def build(robot: Robot) -> RobotWorld:
    """A robot is no world to be had for nothing."""
    raise SpecError(
        f"the world 'robot' is a real {robot.name}, or its emulator. Drive it with: bns trial --robot {robot.name}"
    )
