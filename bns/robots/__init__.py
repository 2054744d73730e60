"""Robots, one module each: what a command is, its bounds, operators and kinematics. Found by listing this folder."""

from __future__ import annotations

import pkgutil
from importlib import import_module

from bns.errors import SpecError, unknown_name
from bns.robots.base import Robot


def robot_names() -> tuple[str, ...]:
    """Every robot there is a module for."""
    return tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if m.name not in {"base", "simulator"}))


def load_robot(name: str) -> Robot:
    """The robot of that name; SpecError for an unknown one lists those there are."""
    if name not in robot_names():
        raise SpecError(unknown_name("robot", name, robot_names()))
    robot: Robot = import_module(f"bns.robots.{name}").ROBOT
    return robot
