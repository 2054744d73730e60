"""The physics world: ``bns/physics/ROBOT_drive.py`` drives a model of the robot of that name."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec

from bns.errors import ModelError
from bns.robots.base import Robot
from bns.worlds.base import World


def build(robot: Robot, model: str | None = None) -> World:
    """The robot's own model, as shipped, or the one of a file; ModelError if there is none."""
    module = f"bns.physics.{robot.name}_drive"
    if find_spec(module) is None:
        raise ModelError(f"robot {robot.name} has no physics world; run it with --world substitute.")
    world: World = import_module(module).build(robot, model) if model else import_module(module).build(robot)
    return world
