"""Every effect that a body on joints can lack."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from bns.physics.effect import Effect
from bns.physics.effects import effect_named
from bns.physics.jointed.catalogue_parts import PerJoint, PerLink, PerSite
from bns.registry import JOINT_EFFECTS

Links = tuple[tuple[str, int], ...]
"""Links: their names and numbers."""
Joints = tuple[tuple[str, bool], ...]
"""Joints with a servo: their names, and whether its torque is limited."""
Sites = tuple[tuple[str, bool], ...]
"""Tracked sites: their names, and whether a load may be fixed there."""


@lru_cache(maxsize=32)
def catalogue(
    joints: Joints, sites: Sites, links: Links, on_floor: Links, free: bool
) -> dict[str, Effect]:
    """Name -> effect of a body with these joints, tracked sites and links; what the floor does only to one that lies on it.

    ``on_floor``: the links that may touch it.
    """
    parts = [JOINT_EFFECTS.load(name) for name in JOINT_EFFECTS.names()]
    listed = (effect for part in parts for effect in _members(part, joints, sites, links, on_floor if free else ()))
    clocks = (effect_named(name) for name in ("clock-offset", "clock-drift"))
    return {e.name: e for e in (*listed, *clocks) if free or e.name not in OF_THE_FLOOR}


OF_THE_FLOOR = ("floor-friction", "friction-anisotropy", "floor-slope", "floor-patch", "tether-pull", "tether-drag")
"""Effects that a body fixed to the world cannot have, beside those of its links."""


def _members(
    part: Effect | PerJoint | PerSite | PerLink,
    joints: Joints,
    sites: Sites,
    links: Links,
    on_floor: Links,
) -> Iterator[Effect]:
    if isinstance(part, PerJoint):
        yield from (part.of(joint) for joint, limited in joints if limited or not part.limited)
    elif isinstance(part, PerSite):
        yield from (part.of(site, at) for at, (site, may) in enumerate(sites) if may or not part.carries)
    elif isinstance(part, PerLink):
        yield from (part.of(*link) for link in (on_floor if part.on_floor else links))
    else:
        yield part
