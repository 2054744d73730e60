"""Worlds, one module each with a function `build(robot)`, or such a module or object of an installed package."""

from __future__ import annotations

from bns.change import change_of
from bns.errors import SpecError
from bns.registry import WORLDS
from bns.robots.base import Robot
from bns.worlds.base import World
from bns.worlds.changing import ChangingWorld
from bns.worlds.physics import build as build_physics

_NEEDED = ("digest", "drive", "repeatable", "renderable")


def build_world(name: str, robot: Robot) -> World:
    """The world of that name (the names are checked by `RunSpec`) for a robot; physics driving that model, if it is a file.

    ModelError if there is no such file, or the robot's physics takes none; SpecError if a package's world is none.
    """
    if change := change_of(name):
        return ChangingWorld(build_world(change.before, robot), build_world(change.after, robot), change.at)
    if name.endswith((".yaml", ".yml")):
        return build_physics(robot, name)
    world: World = WORLDS.load(name).build(robot)
    missing = [attribute for attribute in _NEEDED if not hasattr(world, attribute)]
    if missing:
        raise SpecError(
            f"the world {name!r} of {WORLDS.part(name).origin} lacks {', '.join(missing)}; derive it from bns.worlds.base.World."
        )
    return world
