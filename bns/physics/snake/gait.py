"""The commands of a cycle: its gait from beginning to end, checked."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bns.errors import ModelError
from bns.robots.snake.gait import COMMANDS_A_CYCLE, joint_angles

PARAMETERS = ("a_lat_rad", "a_vert_rad", "omega_rad", "alpha_rad")
GREATEST_RAD = np.pi / 2
"""No joint of a gait bends further."""


def cycle_angles(parameters: ArrayLike, joints: int = 12, switched: bool = False) -> np.ndarray:
    """Angles (13, joints), rad, of every servo at every command of one cycle.

    ``parameters`` (4,): A_lateral, A_vertical, ω, α, as in `joint_angles`. ModelError unless 0 <= A_vert < A_lat <= π/2 (A_lat
    = 0 is a robot that lies still) and all are finite.
    """
    return joint_angles(_checked(parameters), np.arange(COMMANDS_A_CYCLE), joints, switched)


def _checked(parameters: ArrayLike) -> np.ndarray:
    given = np.asarray(parameters, np.float64)
    if given.shape != (4,) or not np.isfinite(given).all():
        raise ModelError(f"a cycle is given as {given.tolist()}; give four finite numbers: {', '.join(PARAMETERS)}.")
    a_lat, a_vert = given[:2]
    if not (0 <= a_vert < a_lat <= GREATEST_RAD + 1e-6 or a_lat == a_vert == 0):
        raise ModelError(
            f"the amplitudes are a_lat_rad = {a_lat:g} and a_vert_rad = {a_vert:g}; allowed is "
            "0 <= a_vert_rad < a_lat_rad <= pi/2 (a body that lifts higher than it bends tips over): lower a_vert_rad."
        )
    return given
