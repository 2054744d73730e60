"""Robots, one module each, or one object of an installed package: what a command is, its bounds, operators and kinematics."""

from __future__ import annotations

from bns.errors import SpecError, unknown_name
from bns.registry import ROBOTS
from bns.robots.base import Robot
from bns.spec import OPTION_MARK, robot_and_options


def robot_names() -> tuple[str, ...]:
    """Every robot there is; none is imported."""
    return ROBOTS.names()


def load_robot(name: str) -> Robot:
    """The robot of that name, with the options that are added to it; SpecError for an unknown one lists those there are."""
    base, options = robot_and_options(name)
    robot: Robot = ROBOTS.load(base)
    if not options:
        return robot
    for option in options:
        if option not in robot.options:
            raise SpecError(unknown_name(f"option of robot {base}", option, robot.options or ("none",)))
    if list(options) != sorted(set(options)):
        right = OPTION_MARK.join([base, *sorted(set(options))])
        raise SpecError(f"the robot is {name!r}; write each option once, in alphabetical order: {right}.")
    return robot.with_options(options)
