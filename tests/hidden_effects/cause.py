"""What a hidden effect can take hold of, in the order in which a command becomes a tracked pose."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

MOVING_M_S = 1e-3
"""A wheel turns when its surface is faster than this."""


class Moment(NamedTuple):
    """When the steps of the integration lie, and the generator of whatever is random about an effect.

    `trial_s` (t,) is the middle of each step since the trial began, `session_s` (n, 1) when each trial began.
    """

    step_s: float
    trial_s: np.ndarray
    session_s: np.ndarray
    rng: np.random.Generator


class Body(NamedTuple):
    """Velocities during a step: forward, turn, sideways to the right; east and north in the world; a wheel turns (0 or 1)."""

    forward: np.ndarray
    turn: np.ndarray
    right: np.ndarray
    east: np.ndarray
    north: np.ndarray
    moving: np.ndarray


class Cause:
    """An effect that does nothing: real ones change one or two of these.

    Arrays are (n, k, 2) for commands, (n, t, 2) for wheels, (n, t) for the body, (n, frames, 3) for poses.
    """

    delay_s = 0.0
    late_s = 0.0
    heading_late_s = 0.0
    wheelbase = 1.0
    depends_on_pose = False

    def command(self, wheels: np.ndarray) -> np.ndarray:
        """What the motors make of a command."""
        return wheels

    def edges(self, edges_s: np.ndarray) -> np.ndarray:
        """When the motors hear of commands given at these times, (n, k + 1)."""
        return edges_s

    def demand(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        """What time makes of it."""
        return wheels

    def wheels(self, wheels: np.ndarray, moment: Moment) -> np.ndarray:
        """What the wheels do: mean speed during each step."""
        return wheels

    def body(self, body: Body, moment: Moment) -> Body:
        """What the robot does when its wheels turn so."""
        return body

    def place(self, body: Body, x: np.ndarray, y: np.ndarray, heading: np.ndarray) -> Body:
        """The same where it depends on the pose; arrays (n,)."""
        return body

    def seen(self, poses: np.ndarray) -> np.ndarray:
        """What the camera makes of a pose."""
        return poses
