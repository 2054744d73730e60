"""Robots, one module each: what a command is, its bounds, operators and kinematics. Found by listing this folder."""

from __future__ import annotations

import pkgutil
from importlib import import_module

from bns.errors import SpecError, unknown_name
from bns.robots.base import Robot
from bns.spec import OPTION_MARK, robot_and_options


def robot_names() -> tuple[str, ...]:
    """Every robot there is a module for."""
    return tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if m.name not in {"base", "simulator"}))


def load_robot(name: str) -> Robot:
    """The robot of that name, with the options that are added to it; SpecError for an unknown one lists those there are."""
    base, options = robot_and_options(name)
    if base not in robot_names():
        raise SpecError(unknown_name("robot", base, robot_names()))
    robot: Robot = import_module(f"bns.robots.{base}").ROBOT
    if not options:
        return robot
    for option in options:
        if option not in robot.options:
            raise SpecError(unknown_name(f"option of robot {base}", option, robot.options or ("none",)))
    if list(options) != sorted(set(options)):
        right = OPTION_MARK.join([base, *sorted(set(options))])
        raise SpecError(f"the robot is {name!r}; write each option once, in alphabetical order: {right}.")
    return robot.with_options(options)
