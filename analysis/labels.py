"""The labels that figures share: numbers, parameters, tasks, what a success is."""

from __future__ import annotations

import re

from bns.errors import SpecError
from bns.spec import field_type
from bns.tasks import load_task

TITLES = {
    "population_size": "population size",
    "tournament_size": "tournament size",
    "mutation_rate": "mutation rate",
    "real_world_selection_size": "real-world selection size",
}
"""The parameters whose combinations the dissertation compares (table 4.3), and what they are called on a figure."""
CELL = tuple(TITLES)
"""Their columns; together they name a combination."""
SHORT = {
    "population_size": "population",
    "tournament_size": "tournament",
    "mutation_rate": "mutation",
    "real_world_selection_size": "real-world selection",
}
"""The same where there is little room."""


def counted(n: int, noun: str) -> str:
    """``1 run``, ``1,200 runs``."""
    return f"{n:,} {noun}" if n == 1 else f"{n:,} {noun}s"


def each(few: int, most: int, noun: str = "run") -> str:
    """``5 runs``, ``5 to 30 runs``."""
    return counted(most, noun) if few == most else f"{few:,} to {most:,} {noun}s"


def percent(share: float) -> str:
    """0.1 as ``10 %``."""
    return f"{100 * share:g} %"


def valued(parameter: str, value: float) -> str:
    """A parameter's value as it stands on a figure: shares in per cent."""
    return f"{value:,g}" if field_type(parameter) is int else percent(value)


def task_title(robot: str, task: str) -> str:
    """Title of a task; its name, if this version has no such task."""
    try:
        return load_task(robot, task).title
    except SpecError:
        return task


def task_order(robot: str, task: str) -> tuple[str, str]:
    """Sort key: the dissertation's order of tasks."""
    try:
        return load_task(robot, task).source, task
    except SpecError:
        return "unknown", task


def task_number(robot: str, task: str) -> int | None:
    """Which of the dissertation's tasks of that robot this is, from 1; None for a task that the dissertation does not have."""
    words = task_order(robot, task)[0].split(" (")[0].split()
    return int(words[-1]) if len(words) > 1 and words[-1].isdigit() else None


def source_position(paper: str) -> tuple[float, float]:
    """Where a figure stands in the dissertation, (4, 12) for "figures 4.12 and 5.27"; last of all what the dissertation lacks."""
    number = re.search(r"(?:figure|table)s? (\d+)\.(\d+)", paper)
    return (float(number[1]), float(number[2])) if number else (float("inf"), 0.0)
