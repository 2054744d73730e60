"""What effects of a body on joints change: plain numbers beside the body's model, neutral where nothing is wrong.

stage ``mechanics``: servos, links, floor and tether, before anything moves · ``sight``: what a camera makes of where the tracked
points really are. Between them the body is simulated.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rough:
    """A place of the floor, round (x_m, y_m), where the friction is exp(``rise``) times what it is elsewhere.

    ``disc``: within ``reach_m`` of the middle, with a soft rim; else a tent, the product of two hats that fall to 0 ``reach_m``
    from the middle in x and in y. Tents that stand ``reach_m`` apart add up to a level floor.
    """

    x_m: float
    y_m: float
    reach_m: float
    rise: float
    disc: bool = True

    def at(self, place_m: Array) -> Array:
        """The logarithm of the factor at places (..., 2)."""
        off = place_m - np.array([self.x_m, self.y_m])
        if self.disc:
            beyond = np.clip((np.hypot(off[..., 0], off[..., 1]) - self.reach_m) / RIM_M, -50, 50)
            share = 1 / (1 + np.exp(beyond))
        else:
            share = np.maximum(1 - np.abs(off) / self.reach_m, 0.0).prod(axis=-1)
        return np.asarray(self.rise * share)


RIM_M = 0.02
"""A link's contacts with the floor are a few centimetres apart: it does not cross the rim of a place at once."""


@dataclass(frozen=True)
class Plant:
    """Stage ``mechanics``.

    Of each joint with a servo, (joints,): ``stiffness`` and ``torque`` (its limit) as factors, ``zero_rad`` (where it is when it
    believes to be at 0), ``damping`` (of a servo that damps by itself) as a factor, ``speed`` (its limit as a share of the
    fastest that it is told to move; from 1 on none), ``friction_rad`` (dry friction beyond the model's: the error that its servo
    needs to overcome it). Of each link, (links,): ``mass`` and ``grip`` (on the floor, all ways) as factors.
    Of each tracked site, (sites,): ``payload``, the mass of a load there as a multiple of the whole body's.
    ``friction_along``, ``friction_across``: of links on the floor, factors along and across their own axes.
    ``dead_band_rad`` and ``delay_s`` come on top of the model's own. ``sag``: share of stiffness and torque limit that is lost
    when all servos pull with all they have. ``rough``: places of the floor with another friction. ``slope``: fall of the floor
    towards east and north, rad. ``pull_n``: force of the tether east and north; ``return_n_m``: the same a metre of way from the
    origin, back to it; ``drag_n``: of the tether against its motion, beyond the model's own.
    """

    joints: tuple[str, ...]
    stiffness: Array
    torque: Array
    zero_rad: Array
    speed: Array
    damping: Array
    friction_rad: Array
    mass: Array
    grip: Array
    payload: Array
    friction_along: float = 1.0
    friction_across: float = 1.0
    dead_band_rad: float = 0.0
    delay_s: float = 0.0
    sag: float = 0.0
    rough: tuple[Rough, ...] = ()
    slope: tuple[float, float] = (0.0, 0.0)
    pull_n: tuple[float, float] = (0.0, 0.0)
    return_n_m: float = 0.0
    drag_n: float = 0.0

    @property
    def key(self) -> bytes:
        """The same for two plants alone of which nothing differs."""
        of = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "joints"}
        of["rough"] = [astuple(place) for place in self.rough]
        return np.concatenate([np.asarray(values, dtype=np.float64).ravel() for values in of.values()]).tobytes()

    def with_joint(self, values: str, joint: str, value: float) -> Plant:
        """One joint's entry of an array of joints multiplied by a factor; to ``zero_rad`` or ``friction_rad`` it is added."""
        changed = getattr(self, values).copy()
        at = self.joints.index(joint)
        changed[at] = changed[at] + value if values in {"zero_rad", "friction_rad"} else changed[at] * value
        return replace(self, **{values: changed})

    def with_link(self, values: str, link: int, factor: float) -> Plant:
        """One link's entry of an array of links multiplied by a factor."""
        changed = getattr(self, values).copy()
        changed[link] *= factor
        return replace(self, **{values: changed})

    def with_payload(self, site: int, load: float) -> Plant:
        """A load more at one site, as a multiple of the body's mass."""
        payload = self.payload.copy()
        payload[site] += load
        return replace(self, payload=payload)


def sound(joints: tuple[str, ...], links: int, sites: int) -> Plant:
    """The plant with nothing wrong."""
    n = len(joints)
    servos = np.ones(n), np.ones(n), np.zeros(n), np.full(n, np.inf), np.ones(n), np.zeros(n)
    return Plant(joints, *servos, np.ones(links), np.ones(links), np.zeros(sites))


@dataclass(frozen=True)
class Sighting:
    """Stage ``sight``: tracked points in the world's frame.

    ``point_m`` (..., sites, 2): x and y; ``along``, ``left`` (..., sites, 2): each site's own axes as seen from above.
    """

    point_m: Array
    along: Array
    left: Array
