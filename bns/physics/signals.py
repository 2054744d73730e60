"""What passes from one stage of the simulation to the next: whole trials at once, never one instant.

wheel: commanded speeds become the speeds of the wheels' surfaces · body: these become velocities of the robot
· world: the floor and what hangs on the robot add to them · measure: the tracker sees the resulting poses.

Arrays are (batch, steps). A value is the mean over its step, so that distances stay exact where a speed
changes inside a step. Steps of length 0 pad short trials and must do nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CREEP_M_S = 1e-3
"""Wheels slower than this count as partly moving: a jump at zero would be hard to fit. When a robot
begins to move, and with it what acts on it only while moving, is thus known to one step."""


@dataclass(frozen=True)
class Wheels:
    """Stage ``wheel``: mean speeds of the two wheels' surfaces in m/s, at rest before the first step."""

    step_s: Array
    left_m_s: Array
    right_m_s: Array
    wheelbase_m: float


@dataclass(frozen=True)
class Body:
    """Stage ``body``: velocities in the robot's frame; ``moving`` runs from 0 (wheels at rest) to 1.

    ``sideways_m_s`` is positive to the right, ``yaw_rad_s`` counter-clockwise.
    """

    forward_m_s: Array
    sideways_m_s: Array
    yaw_rad_s: Array
    moving: Array


@dataclass(frozen=True)
class Flow:
    """Stage ``world``: velocity added while the wheels turn, x_m_s - return_per_s·x; so for y.

    Affine in the position, so that any number of effects add up in any order and the step is solved exactly.
    """

    x_m_s: float = 0.0
    y_m_s: float = 0.0
    return_per_s: float = 0.0


@dataclass(frozen=True)
class View:
    """Stage ``measure``: poses as the tracker reports them, (..., 3): x_m, y_m, heading_rad."""

    poses: Array
