"""Joint angles of a gait: equations 5.1 and 5.2."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

JOINTS = 12
GAMMA_RAD = 2.0 * np.pi / 12.0
"""Temporal step γ: one period of the sine in a cycle."""
COMMANDS_A_CYCLE = 13
"""Angle sets of a cycle, t = 0..12: the first and the last are the same (section 5.3.2)."""


def joint_angles(cycles: ArrayLike, t: ArrayLike = 0, joints: int = JOINTS, switched: bool = False) -> np.ndarray:
    """Angles (..., joints), rad, at command ``t`` of cycles (..., 4): A_lateral, A_vertical, ω, α.

    Even joints are lateral: A_lat sin(θ + α); odd ones vertical: A_vert sin θ; θ = ω n + γ t; both offsets are zero.
    ``switched``: the robot lies on its side, so that the even ones are vertical (section 5.2).
    """
    a_lat, a_vert, omega, alpha = np.moveaxis(np.asarray(cycles, np.float64), -1, 0)[..., None]
    n = np.arange(joints)
    theta = omega * n + GAMMA_RAD * np.asarray(t, np.float64)[..., None]
    return np.where(n % 2 == int(switched), a_lat * np.sin(theta + alpha), a_vert * np.sin(theta))
