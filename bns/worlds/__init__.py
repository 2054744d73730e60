"""Worlds, one module each with a function `build(robot)`. Found by name."""

from __future__ import annotations

from importlib import import_module

from bns.robots.base import Robot
from bns.worlds.base import World
from bns.worlds.physics import build as build_physics


def build_world(name: str, robot: Robot) -> World:
    """The world of that name (the names are checked by `RunSpec`) for a robot; physics driving that model, if it is a file.

    ModelError if there is no such file, or the robot's physics takes none.
    """
    if name.endswith((".yaml", ".yml")):
        return build_physics(robot, name)
    world: World = import_module(f"bns.worlds.{name}").build(robot)
    return world
