"""The robot world: what a robot really did. It is driven by a trial; here its paths are handed to whoever judges them."""

from __future__ import annotations

import numpy as np

from bns.engine.philox import Key, Purpose
from bns.errors import SpecError
from bns.robots.base import Robot


class RobotWorld:
    """Answers with the path that was driven last, in the frame of the task."""

    repeatable = False

    def __init__(self, digest: str) -> None:
        self.digest = digest
        self._poses = np.empty((0, 3))

    def answered(self, poses: np.ndarray) -> None:
        """The robot has driven: poses (n, 3) at the end of each command, in the task's frame."""
        self._poses = poses

    def drive(self, commands: np.ndarray, key: Key, purpose: Purpose, step: int) -> np.ndarray:
        """The path of the drive just made; SpecError if it was not made with these commands."""
        if purpose is not Purpose.WORLD_EVALUATED or len(commands) != len(self._poses):
            raise SpecError(f"a robot has not driven these {len(commands)} commands; it drives what is picked, once.")
        return self._poses


def in_task_frame(poses: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Tracked poses (n + 1, 3) moved so that the first lies on `start` (3,); the others, (n, 3).

    An operator puts a robot down within centimetres and degrees; what the networks learn is what it did from there.
    """
    x0, y0, heading0 = poses[0]
    turn = start[2] - heading0
    cos, sin = np.cos(turn), np.sin(turn)
    dx, dy = poses[1:, 0] - x0, poses[1:, 1] - y0
    return np.column_stack([start[0] + cos * dx - sin * dy, start[1] + sin * dx + cos * dy, poses[1:, 2] + turn])


def build(robot: Robot) -> RobotWorld:
    """A robot is no world to be had for nothing."""
    raise SpecError(f"the world 'robot' is a real {robot.name}, or its emulator. Drive it with: bns trial --robot {robot.name}")
