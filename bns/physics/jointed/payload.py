"""A load that a link of a MuJoCo model carries: its mass, centre of mass and inertia with a point mass fixed to it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bns.extras import deferred

mujoco = deferred("snake", "mujoco")


def carry(model: Any, body: int, point_m: NDArray[np.float64], load_kg: float) -> None:
    """Fix a point mass to a body at ``point_m`` (3,), in the body's frame. `mujoco.mj_setConst` has to follow.

    By the parallel axis theorem: every mass counts its inertia about the common centre of mass.
    """
    own_kg, own_m = float(model.body_mass[body]), model.body_ipos[body].copy()
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[body])
    axes = turn.reshape(3, 3)
    centre = (own_kg * own_m + load_kg * point_m) / (own_kg + load_kg)
    about = axes @ np.diag(model.body_inertia[body]) @ axes.T
    about = about + own_kg * _of_point(own_m - centre) + load_kg * _of_point(point_m - centre)
    moments, main = np.linalg.eigh(about)
    if np.linalg.det(main) < 0:
        main[:, 0] *= -1
    model.body_mass[body], model.body_ipos[body] = own_kg + load_kg, centre
    model.body_inertia[body] = moments
    mujoco.mju_mat2Quat(model.body_iquat[body], np.ascontiguousarray(main).ravel())
    _apart(model, body)


def _of_point(at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inertia (3, 3) of a unit mass there, about the origin."""
    out: NDArray[np.float64] = (at @ at) * np.eye(3) - np.outer(at, at)
    return out


def _apart(model: Any, body: int) -> None:
    """Where the frames of a body, its geoms and sites were one with that of its inertia, they no longer are.

    `mujoco.mj_setConst` sees to it in MuJoCo 4, not in all releases that may be installed.
    """
    model.body_sameframe[body] = 0
    inertia = int(mujoco.mjtSameFrame.mjSAMEFRAME_INERTIA), int(mujoco.mjtSameFrame.mjSAMEFRAME_INERTIAROT)
    for owner, same in ((model.geom_bodyid, model.geom_sameframe), (model.site_bodyid, model.site_sameframe)):
        same[(owner == body) & np.isin(same, inertia)] = 0
