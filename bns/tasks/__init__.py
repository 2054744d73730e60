"""Goal tasks, one YAML file each under the robot's name; those of packages come as files or objects."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from types import ModuleType
from typing import Any

import numpy as np
import yaml

from bns.errors import SpecError, unknown_name
from bns.registry import Part, Registry
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
    radius_m: float | None = None
    """How near a point must be passed in evolution; None: as near as the robot says. Success on the robot is not judged by it."""

    def narrower(self, margin_m: float, radius_m: float) -> Task:
        """The task with goals that are smaller all around; ``radius_m`` is that of its points. SpecError if nothing is left."""
        left = (self.region_m / 2 if self.region_m else radius_m) - margin_m
        if left <= 0:
            raise SpecError(
                f"task {self.name}: a margin of {margin_m:g} m leaves nothing of goals that reach {left + margin_m:g} m; "
                f"take less than {left + margin_m:g}."
            )
        return replace(self, region_m=2 * left) if self.region_m else replace(self, radius_m=left)


class _Tasks(Registry):
    """Tasks by ``ROBOT.TASK``: a YAML file of ours, or an entry point that leads to a `Task` or to a package with TASK.yaml."""

    def _files(self) -> Iterable[Part]:
        for robot in resources.files(__name__).iterdir():
            if robot.is_dir():
                files = (file.name for file in robot.iterdir() if file.name.endswith(".yaml"))
                yield from (Part(f"{robot.name}.{file.removesuffix('.yaml')}", f"{__name__}.{robot.name}") for file in files)

    def _opened(self, part: Part) -> Task:
        robot, name = part.name.split(".", 1)
        if part.entry is None:
            return task_of(name, yaml.safe_load((resources.files(__name__) / robot / f"{name}.yaml").read_text()))
        task: Task = super()._opened(part)
        return task

    def _checked(self, part: Part, found: Any) -> Task:
        name = part.name.split(".", 1)[-1]
        if isinstance(found, ModuleType):
            found = task_of(name, yaml.safe_load((resources.files(found) / f"{name}.yaml").read_text(encoding="utf-8")))
        if not isinstance(found, Task):
            raise SpecError(f"it is no bns.tasks.Task, and no package with a file {name}.yaml")
        if found.name != name:
            raise SpecError(f"it calls itself {found.name!r}; the entry point must be called ROBOT.{found.name}")
        return found


TASKS = _Tasks("task", "tasks", "bns.tasks", "", "", (), SpecError)


def task_names(robot: str) -> tuple[str, ...]:
    """Tasks of a robot, by name; its options have no part in them."""
    prefix = robot_and_options(robot)[0] + "."
    found = tuple(sorted(name.removeprefix(prefix) for name in TASKS.names() if name.startswith(prefix)))
    if not found:
        raise SpecError(f"robot {robot!r} has no tasks.")
    return found


def default_task(robot: str) -> str:
    """The task that a robot is given where none is named: the first of the dissertation."""
    return min(task_names(robot), key=lambda name: (load_task(robot, name).source, name))


@cache
def load_task(robot: str, name: str) -> Task:
    """Read a task; SpecError for an unknown one lists those there are."""
    if name not in task_names(robot):
        raise SpecError(f"robot {robot}: " + unknown_name("task", name, task_names(robot)))
    task: Task = TASKS.load(f"{robot_and_options(robot)[0]}.{name}")
    return task


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
