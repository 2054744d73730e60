"""Goal tasks, one YAML file each under the robot's name."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np
import yaml

from bns.errors import SpecError, unknown_name


@dataclass(frozen=True)
class Task:
    """Goals to visit in order: goals_m (n, 2), x east, y north, metres."""

    name: str
    title: str
    source: str
    goals_m: np.ndarray


def task_names(robot: str) -> tuple[str, ...]:
    """Tasks of a robot; the first is its default."""
    folder = resources.files(__name__) / robot
    if not folder.is_dir():
        raise SpecError(f"robot {robot!r} has no tasks.")
    return tuple(sorted(f.name.removesuffix(".yaml") for f in folder.iterdir() if f.name.endswith(".yaml")))


@cache
def load_task(robot: str, name: str) -> Task:
    """Read a task; SpecError for an unknown one lists those there are."""
    if name not in task_names(robot):
        raise SpecError(unknown_name(f"task of robot {robot}", name, task_names(robot)))
    content = yaml.safe_load((resources.files(__name__) / robot / f"{name}.yaml").read_text())
    goals = np.asarray(content["goals_m"], np.float64)
    goals.setflags(write=False)
    return Task(name, content["title"], content["source"], goals)
