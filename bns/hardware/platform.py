"""What a trial asks of a robot with its tracker, and where the robots are found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from bns.hardware.stop import Stop
from bns.registry import PLATFORMS


@dataclass(frozen=True)
class Driven:
    """What a controller became on the robot.

    commands (k, components): those carried out, with what was really sent and how long it really lasted; poses (k + 1,
    columns): as the robot's module has them, tracked, in the world frame, the first at the start, the others at the end of each
    command; rows: measurements, a row a look; ended: why it was over before its end, or nothing; seconds it took; spans_s: when
    each command was under way, of a robot whose commands can be unstable; stuck: what would not move any more, where that ended
    it; leaps: how many poses were further from those before than the robot can drive, or turned further than it can turn; note:
    what whoever reads the measurements should know of the commands, told once a session.
    """

    commands: np.ndarray
    poses: np.ndarray
    rows: list[dict[str, float]]
    stop: Stop
    ended: str = ""
    seconds: float = 0.0
    spans_s: Sequence[tuple[float, float]] = ()
    stuck: str = ""
    leaps: int = 0
    note: str = ""


class Platform(Protocol):
    """A robot on its rig, ready to drive.

    It may have ``lasts_s(commands)``, too: how long a controller is expected to drive on this rig, s. Without, the robot's module
    says.
    """

    @property
    def retries(self) -> int:
        """How often a question was asked again so far."""

    def pose(self) -> np.ndarray | None:
        """Where the robot stands (3,), from several looks; None if it is not seen."""

    def drive(self, commands: np.ndarray) -> Driven:
        """Carry out a controller (n, components); the robot stands still, confirmed, when this returns or raises.

        TrialPausedError, StopNotConfirmedError.
        """

    def readings(self) -> dict[str, float]:
        """Voltages, temperatures: name with unit -> value; TrialPausedError if they do not allow another drive."""

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


class PlatformModule(Protocol):
    """What the module of a robot's driver has, ours or an installed package's."""

    RIG: Any
    """The file with the example rig, which `--emulated` uses: a path, or what `importlib.resources` gives."""


    def open_platform(self, rig: Any, clock: Any, journal: Any, stopping: Any) -> Platform:
        """Open port and tracker; HardwareError if they cannot be used."""

    def emulate(self, rig: Any, folder: Any, clock: Any, plan: Any, seed: int) -> Emulation:
        """An emulated robot under an emulated tracker, their ports in `folder`."""


def platform_module(robot: str) -> PlatformModule:
    """The driver of a robot, found by the robot's name; HardwareError lists the robots that have one."""
    module: PlatformModule = PLATFORMS.load(robot)
    return module


def repeats_of(module: PlatformModule) -> int:
    """How often a trial drives its final controller, unless it is told otherwise: ``REPEATS`` of the module, once without."""
    return int(getattr(module, "REPEATS", 1))
