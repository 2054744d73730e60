"""A world: what is hidden in it and how it is looked at, and the table that comes of it."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from tests.hidden_effects.camera import Camera, Layout, track
from tests.hidden_effects.cause import Cause
from tests.hidden_effects.driving import ROBOTS, Driving, Robot, drive
from tests.hidden_effects.listed import LISTED, cause
from tests.hidden_effects.luck import luck
from tests.hidden_effects.motion import Paths, move
from tests.hidden_effects.unlisted import UNLISTED

Parameters = dict[str, float]

USUAL = Camera(0.0015, 0.007)
"""1.5 mm and 0.4 degrees."""
FRAMES = Layout()

SIGNS = {
    "frame": "x east, y north, heading counter-clockwise from x",
    "clock-offset": "poses are stamped this much late: one stamped t was taken at t - offset_s",
    "heading-delay": "a pose's heading is from delay_s before its position",
    "side-slip": "velocity slip_s * v * omega to the right of the heading: outwards in a left turn",
    "battery-sag": "speeds times 1 - rate_per_s * session_s, or times 1 + per_volt * (battery_v - first battery_v)",
    "camera-rotation": "positions turned counter-clockwise about the origin, headings as they are",
}


@dataclass(frozen=True)
class World:
    """All that is needed to make a world again. `jitter`: share by which wheel speeds vary from command to command."""

    name: str
    family: str
    hidden: dict[str, Parameters] = field(default_factory=dict)
    unlisted: dict[str, Parameters] = field(default_factory=dict)
    robot: str = "khepera"
    plan: str = "forward"
    trials: int = 60
    camera: Camera = USUAL
    layout: Layout = FRAMES
    jitter: float = 0.004
    seed: int = 0
    barred: tuple[str, ...] = ()
    """Listed effects that the product is told not to try: hidden as unlisted ones."""

    @property
    def nominal(self) -> Robot:
        """The robot as the lab believes it to be."""
        return ROBOTS[self.robot]

    def causes(self) -> list[Cause]:
        """Everything that is hidden, in the order in which it acts: gears have play behind a motor that lags, not before it."""
        listed = [cause(name, self.hidden[name]) for name in LISTED if name in self.hidden]
        return listed + [{**LISTED, **UNLISTED}[name](**parameters) for name, parameters in self.unlisted.items()]

    @property
    def options(self) -> list[str]:
        """How the product is told what it may not try."""
        return [word for name in self.barred for word in ("--without-effect", name)]

    def driving(self) -> Driving:
        """The commands."""
        grid = 0.001 if self.layout.rows == "frames+changes" else self.layout.frame_s
        return drive(luck(self.seed, self.name, "drive"), self.nominal, self.plan, self.trials, grid)

    def true_paths(self) -> tuple[Driving, Paths]:
        """What the robot did."""
        driving, causes = self.driving(), self.causes()
        jitter = motor_jitter(luck(self.seed, self.name, "jitter"), driving.wheels_m_s.shape, self.jitter)
        rng = luck(self.seed, self.name, "effects")
        return driving, move(driving, self.nominal.wheelbase_m, causes, jitter, rng, self.layout.tail_s)

    def table(self) -> pd.DataFrame:
        """What the lab has of it."""
        driving, paths = self.true_paths()
        rng = luck(self.seed, self.name, "camera")
        return track(rng, paths, driving, self.causes(), self.camera, self.layout)

    def truth(self) -> dict[str, object]:
        """For truth.json."""
        return asdict(self) | {"arguments": list(self.nominal.arguments), "conventions": SIGNS}


def motor_jitter(rng: np.random.Generator, shape: tuple[int, ...], share: float) -> np.ndarray:
    """(n, k, 2): white from command to command, and half as much from trial to trial."""
    return share * (rng.normal(size=shape) + 0.5 * rng.normal(size=(shape[0], 1, 2)))


def write(world: World, folder: Path, acceptable: list[dict[str, object]]) -> Path:
    """data.csv and truth.json in a folder of the world's name."""
    place = folder / world.name
    place.mkdir(parents=True, exist_ok=True)
    table = world.table()
    table = table.round({"t_s": 5, "session_s": 5, "x_m": 6, "y_m": 6, "heading_rad": 6, "left_m_s": 7, "right_m_s": 7})
    table.to_csv(place / "data.csv", index=False)
    (place / "truth.json").write_text(json.dumps(world.truth() | {"acceptable": acceptable}, indent=1) + "\n")
    return place / "data.csv"
