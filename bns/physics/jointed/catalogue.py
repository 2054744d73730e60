"""Every effect that a body on joints can lack."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from bns.physics.effect import Effect
from bns.physics.effects import effect_named
from bns.physics.jointed.catalogue_parts import PerJoint, PerSite
from bns.registry import JOINT_EFFECTS


@lru_cache(maxsize=32)
def catalogue(joints: tuple[str, ...], sites: tuple[str, ...], free: bool) -> dict[str, Effect]:
    """Name -> effect of a body with these joints and tracked sites; what the floor does only to one that lies on it."""
    listed = (effect for name in JOINT_EFFECTS.names() for effect in _members(JOINT_EFFECTS.load(name), joints, sites))
    clocks = (effect_named(name) for name in ("clock-offset", "clock-drift"))
    return {e.name: e for e in (*listed, *clocks) if free or e.name not in OF_THE_FLOOR}


OF_THE_FLOOR = ("floor-friction", "friction-anisotropy", "floor-slope", "tether-pull", "tether-drag")
"""Effects that a body fixed to the world cannot have."""


def _members(part: Effect | PerJoint | PerSite, joints: tuple[str, ...], sites: tuple[str, ...]) -> Iterator[Effect]:
    if isinstance(part, PerJoint):
        yield from (part.of(joint) for joint in joints)
    elif isinstance(part, PerSite):
        yield from (part.of(site, number) for number, site in enumerate(sites))
    else:
        yield part
