"""Why a cycle counts as unstable (section 5.3.2): each cause by its name."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bns.extras import extra
from bns.physics.snake.parameters import SnakeParameters

with extra("snake"):
    import mujoco

TIPPED, COLLISION, STALLED, BLEW_UP = "tipped-over", "self-collision", "torque-limit", "not-finite"
CAUSES = (TIPPED, COLLISION, STALLED, BLEW_UP)
"""Not upright; links touch; a servo sits at its torque limit; the arithmetic failed."""
_FAILURES = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
)
"""MuJoCo puts such a body back to its start and goes on: the state looks sound, only the warning tells."""

# Left alone, MuJoCo writes a log file into whatever folder it is run in.
mujoco.set_mju_user_warning(lambda _message: None)


def mean_roll_rad(rotations: np.ndarray) -> float:
    """Mean roll of links with rotation matrices (links, 3, 3) about their own axes; 0 upright, π on the back."""
    sideways, up = rotations[:, 2, 1], rotations[:, 2, 2]
    return float(np.arctan2(sideways.sum(), up.sum()))


@dataclass
class Watch:
    """Looks at the body while a cycle goes on, and remembers what it saw."""

    parameters: SnakeParameters
    model: mujoco.MjModel
    seen: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self._at_limit_s = np.zeros(self.parameters.joints)
        self._floor = self.model.geom("floor").id
        self._force = np.zeros(6)

    def look(self, data: mujoco.MjData, elapsed_s: float) -> None:
        """Take in the state ``elapsed_s`` after the last look."""
        p = self.parameters
        if not np.isfinite(data.qpos).all() or any(data.warning[kind].number for kind in _FAILURES):
            self.seen.add(BLEW_UP)
            return
        if abs(mean_roll_rad(data.xmat[1:].reshape(-1, 3, 3))) > p.tipped_rad:
            self.seen.add(TIPPED)
        limited = np.abs(data.actuator_force) > 0.99 * p.torque_limit_n_m
        self._at_limit_s = np.where(limited, self._at_limit_s + elapsed_s, 0.0)
        if self._at_limit_s.max() > p.stalled_s:
            self.seen.add(STALLED)
        if COLLISION not in self.seen and self._touching(data):
            self.seen.add(COLLISION)

    def _touching(self, data: mujoco.MjData) -> bool:
        between_links = (data.contact.geom != self._floor).all(axis=1)
        for contact in np.flatnonzero(between_links):
            mujoco.mj_contactForce(self.model, data, contact, self._force)
            if self._force[0] > self.parameters.collision_n:
                return True
        return False

    @property
    def causes(self) -> tuple[str, ...]:
        """What made the cycle unstable, in the order of `CAUSES`; empty if it was stable."""
        return tuple(cause for cause in CAUSES if cause in self.seen)
