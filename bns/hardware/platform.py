"""What a trial asks of a robot with its tracker, and where the robots are found."""

from __future__ import annotations

import pkgutil
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import Any, Protocol

import numpy as np

from bns.errors import HardwareError, unknown_name
from bns.hardware import platforms
from bns.hardware.stop import Stop


@dataclass(frozen=True)
class Driven:
    """What a controller became on the robot.

    commands (k, components): those carried out, with what was really sent and how long it really lasted; poses (k + 1,
    columns): as the robot's module has them, tracked, in the world frame, the first at the start, the others at the end of each
    command; rows: measurements, a row a look; ended: why it was over before its end, or nothing; seconds it took; spans_s: when
    each command was under way, of a robot whose commands can be unstable.
    """

    commands: np.ndarray
    poses: np.ndarray
    rows: list[dict[str, float]]
    stop: Stop
    ended: str = ""
    seconds: float = 0.0
    spans_s: Sequence[tuple[float, float]] = ()


class Platform(Protocol):
    """A robot on its rig, ready to drive."""

    retries: int

    def pose(self) -> np.ndarray | None:
        """Where the robot stands (3,), from several looks; None if it is not seen."""

    def drive(self, commands: np.ndarray) -> Driven:
        """Carry out a controller (n, components); the robot stands still, confirmed, when this returns or raises.

        TrialPausedError, StopNotConfirmedError.
        """

    def readings(self) -> dict[str, float]:
        """Voltages, temperatures: name with unit -> value."""

    def stop(self) -> Stop:
        """Stop and confirm; never raises."""

    def close(self) -> None:
        """Give port and tracker free."""


class Emulation(Protocol):
    """An emulated rig while it exists: its `rig` names its ports."""

    rig: Any

    def put_down(self, pose: np.ndarray) -> None:
        """What an operator would do: place the robot at a pose (3,)."""

    def unstable_between(self, begin_s: float, end_s: float) -> bool:
        """Whether somebody who watched would call what the robot did in that time unstable."""

    def close(self) -> None:
        """Take it away."""


def platform_module(robot: str) -> ModuleType:
    """The module of a robot's platform; it has `open_platform(rig, clock, journal, stopping)`,
    `emulate(rig, folder, clock, plan, seed)` and `REPEATS`, how often a trial drives its final controller."""
    names = sorted(m.name for m in pkgutil.iter_modules(platforms.__path__))
    if robot not in names:
        raise HardwareError(unknown_name("robot with a driver", robot, names))
    return import_module(f"bns.hardware.platforms.{robot}")
