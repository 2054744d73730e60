"""The physics world: the module that a robot names drives a model of it."""

from __future__ import annotations

from importlib import import_module

from bns.errors import ModelError
from bns.robots.base import Robot
from bns.worlds.base import World


def build(robot: Robot, model: str | None = None) -> World:
    """The robot's own model, as shipped, or the one of a file; ModelError if there is none."""
    if not robot.physics:
        raise ModelError(f"robot {robot.name} has no physics world; run it with --world substitute.")
    module = import_module(robot.physics)
    world: World = module.build(robot, model) if model else module.build(robot)
    return world
