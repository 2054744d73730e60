"""Worlds, one module each with a function `build(robot)`. Found by name."""

from __future__ import annotations

from importlib import import_module

from bns.robots.base import Robot
from bns.worlds.base import World


def build_world(name: str, robot: Robot) -> World:
    """The world of that name (the names are checked by `RunSpec`) for a robot."""
    world: World = import_module(f"bns.worlds.{name}").build(robot)
    return world
