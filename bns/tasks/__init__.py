"""Goal tasks, one YAML file each under the robot's name."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
import yaml

from bns.errors import SpecError, unknown_name
from bns.spec import robot_and_options

UNBOUNDED = (float("inf"), float("inf"))


@dataclass(frozen=True)
class Task:
    """Goals to visit in order: goals_m (n, 2), x east, y north, metres.

    Where goals are square regions, ``region_m`` is their width (0: points). ``surface_m`` is the size of the floor, east to
    west and north to south, centred at the origin.
    """

    name: str
    title: str
    source: str
    goals_m: np.ndarray
    region_m: float = 0.0
    surface_m: tuple[float, float] = UNBOUNDED


def task_names(robot: str) -> tuple[str, ...]:
    """Tasks of a robot, by name; its options have no part in them."""
    folder = resources.files(__name__) / robot_and_options(robot)[0]
    if not folder.is_dir():
        raise SpecError(f"robot {robot!r} has no tasks.")
    return tuple(sorted(f.name.removesuffix(".yaml") for f in folder.iterdir() if f.name.endswith(".yaml")))


def default_task(robot: str) -> str:
    """The task that a robot is given where none is named: the first of the source."""
    return min(task_names(robot), key=lambda name: (load_task(robot, name).source, name))


@cache
def load_task(robot: str, name: str) -> Task:
    """Read a task; SpecError for an unknown one lists those there are."""
    if name not in task_names(robot):
        raise SpecError(unknown_name(f"task of robot {robot}", name, task_names(robot)))
    return task_of(name, yaml.safe_load((resources.files(__name__) / robot_and_options(robot)[0] / f"{name}.yaml").read_text()))


def task_of(name: str, content: dict[str, Any]) -> Task:
    """The task that a file's content describes; SpecError if a goal lies outside the surface."""
    goals = np.asarray(content["goals_m"], np.float64)
    goals.setflags(write=False)
    region, surface = float(content.get("region_m", 0.0)), tuple(content.get("surface_m", UNBOUNDED))
    reach = np.abs(goals) + region / 2
    if (reach > np.asarray(surface) / 2).any():
        worst = goals[(reach > np.asarray(surface) / 2).any(axis=1)][0]
        raise SpecError(
            f"task {name}: the goal at ({worst[0]:g}, {worst[1]:g}) m, {region:g} m wide, reaches outside the surface of "
            f"{surface[0]:g} m by {surface[1]:g} m around the origin; move it inside or enlarge surface_m."
        )
    return Task(name, content["title"], content["source"], goals, region, surface)
