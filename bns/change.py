"""Worlds that change: ``BEFORE>AFTER@N`` is the world AFTER from evaluation N on."""

from __future__ import annotations

from typing import NamedTuple

from bns.errors import SpecError

CHANGE_MARK = ">"


class Change(NamedTuple):
    """The names of two worlds, and the first evaluation that is driven in the second one."""

    before: str
    after: str
    at: int


def change_of(world: str) -> Change | None:
    """The change that a world's name says; None for a world that stays. SpecError for half a change."""
    if CHANGE_MARK not in world:
        return None
    before, _, rest = world.partition(CHANGE_MARK)
    after, _, at = rest.rpartition("@")
    if not before or not after or CHANGE_MARK in rest or not at.isdecimal() or int(at) < 2:
        raise SpecError(
            f"world is {world!r}; a world that changes is written BEFORE>AFTER@N, such as physics>worn.yaml@50: the world AFTER "
            "from evaluation N on, and N is 2 at least."
        )
    return Change(before, after, int(at))
