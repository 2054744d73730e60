"""What effects of a body on joints change: plain numbers beside the body's model, neutral where nothing is wrong.

stage ``mechanics``: servos, links, floor and tether, before anything moves · ``sight``: what a camera makes of where the tracked
points really are. Between them the body is simulated.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Plant:
    """Stage ``mechanics``.

    Of each joint with a servo, (joints,): ``stiffness`` and ``torque`` (its limit) as factors, ``zero_rad`` (where it is when it
    believes to be at 0), ``damping`` (of a servo that damps by itself) as a factor, ``speed`` (its limit as a share of the
    fastest that it is told to move; from 1 on none). Of each link, (links,): ``mass`` and ``grip`` (on the floor, all ways) as
    factors. ``friction_along``, ``friction_across``: of links on the floor, factors along and across their own axes.
    ``dead_band_rad`` and ``delay_s`` come on top of the model's own. ``sag``: share of stiffness and torque limit that is lost
    when all servos pull with all they have. ``slope``: fall of the floor towards east and north, rad. ``pull_n``: force of the
    tether east and north; ``return_n_m``: the same a metre of way from the origin, back to it; ``drag_n``: of the tether against
    its motion, beyond the model's own.
    """

    joints: tuple[str, ...]
    stiffness: Array
    torque: Array
    zero_rad: Array
    speed: Array
    damping: Array
    mass: Array
    grip: Array
    friction_along: float = 1.0
    friction_across: float = 1.0
    dead_band_rad: float = 0.0
    delay_s: float = 0.0
    sag: float = 0.0
    slope: tuple[float, float] = (0.0, 0.0)
    pull_n: tuple[float, float] = (0.0, 0.0)
    return_n_m: float = 0.0
    drag_n: float = 0.0

    @property
    def key(self) -> bytes:
        """The same for two plants alone of which nothing differs."""
        numbers = (np.atleast_1d(np.asarray(getattr(self, f.name), dtype=np.float64)) for f in fields(self) if f.name != "joints")
        return np.concatenate(list(numbers)).tobytes()

    def with_joint(self, values: str, joint: str, value: float) -> Plant:
        """One joint's entry of an array of joints multiplied by a factor; of ``zero_rad`` something added."""
        changed = getattr(self, values).copy()
        at = self.joints.index(joint)
        changed[at] = changed[at] + value if values == "zero_rad" else changed[at] * value
        return replace(self, **{values: changed})

    def with_link(self, values: str, link: int, factor: float) -> Plant:
        """One link's entry of an array of links multiplied by a factor."""
        changed = getattr(self, values).copy()
        changed[link] *= factor
        return replace(self, **{values: changed})


def sound(joints: tuple[str, ...], links: int) -> Plant:
    """The plant with nothing wrong."""
    n = len(joints)
    return Plant(joints, np.ones(n), np.ones(n), np.zeros(n), np.full(n, np.inf), np.ones(n), np.ones(links), np.ones(links))


@dataclass(frozen=True)
class Sighting:
    """Stage ``sight``: tracked points in the world's frame.

    ``point_m`` (..., sites, 2): x and y; ``along``, ``left`` (..., sites, 2): each site's own axes as seen from above.
    """

    point_m: Array
    along: Array
    left: Array
