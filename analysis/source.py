"""The dissertation's numbers, read from source.yaml."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import yaml

SOURCE = Path(__file__).with_name("source.yaml")


@cache
def source() -> dict[str, Any]:
    """Everything in source.yaml."""
    content: dict[str, Any] = yaml.safe_load(SOURCE.read_text())
    return content


def trials_of(robot: str, number: int | None) -> list[tuple[float, float]]:
    """Evaluations and minutes of the dissertation's trials of a task; none for a task or robot that it does not have."""
    found = source()["trials"].get(robot, {}).get(number, [])
    return [(float(evaluations), float(minutes)) for evaluations, minutes in found]
