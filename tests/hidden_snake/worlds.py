"""What is hidden, and which answers are right."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from tests.hidden_snake.body import Hidden, Snake

COLUMNS = ("trial", "t_s", "cycle", "a_lat_rad", "a_vert_rad", "omega_rad", "alpha_rad",
           "yellow_x_m", "yellow_y_m", "green_x_m", "green_y_m", "stable")  # fmt: skip


@dataclass(frozen=True)
class World:
    """A family (single, none, two, unlisted), what is hidden, the right effects (none for none and unlisted)."""

    name: str
    family: str
    hidden: Hidden
    right: tuple[str, ...]
    accepted: tuple[str, ...] = ()
    """Effects that do the same in these cycles and may stand in its place in a tie."""


def worlds() -> list[World]:
    """All of them, in the order in which a short time is best used."""

    def single(name: str, hidden: Hidden, effect: str, *ties: str) -> World:
        return World(name, "single", hidden, (effect,), ties)

    return [
        World("none", "none", Hidden(), ()),
        single("friction", Hidden(friction=1.6), "floor-friction"),
        single("weak-joint-5", Hidden(strength={5: 0.4}), "weak-joint-joint5"),
        single("silent-joint-6", Hidden(strength={6: 0.0}), "weak-joint-joint6"),
        single("zero-7", Hidden(zero_rad={7: 0.1}), "joint-zero-joint7"),
        single("stiffness", Hidden(stiffness=0.7), "compliance"),
        single("scale", Hidden(scale=0.03), "camera-scale"),
        single("slope", Hidden(slope_rad=(0.02, -0.01)), "floor-slope"),
        single("sticky-link", Hidden(link_friction={6: 4.0}), "link-friction-link6"),
        World("none-b", "none", Hidden(), ()),
        single("torque", Hidden(torque=0.3), "torque-limit"),
        single("marker", Hidden(marker_m={"green": (0.012, 0.008)}), "marker-offset-green"),
        single("band", Hidden(band_rad=0.06), "dead-band"),
        single("mass", Hidden(gradient=0.6), "uneven-mass"),
        single("sag", Hidden(sag=0.8), "supply-sag"),
        single("drag", Hidden(drag_n=0.3), "tether-drag"),
        single("pull", Hidden(pull_n=(0.0, 0.12), pull_n_m=0.1), "tether-pull"),
        single("speed", Hidden(speed=0.6), "servo-speed-limit"),
        single("scales", Hidden(across=2.0), "friction-anisotropy"),
        single("delay", Hidden(delay_s=0.12), "servo-delay"),
        single("camera", Hidden(tilt_1_m=(0.03, 0.02)), "tilted-camera"),
        World("friction-and-zero", "two", Hidden(friction=1.6, zero_rad={4: 0.1}), ("floor-friction", "joint-zero-joint4")),
        World("long-links", "unlisted", Hidden(pitch=1.06), ()),
        single("patch", Hidden(patch=(0.3, 3.0)), "floor-patch", "link-friction-link12"),
        World("tired", "unlisted", Hidden(tired_per_cycle=0.1), ()),
        single("smooth", Hidden(friction=0.5), "floor-friction"),
        single("weak-joint-2", Hidden(strength={2: 0.3}), "weak-joint-joint2"),
        single("weak-joint-8", Hidden(strength={8: 0.5}), "weak-joint-joint8"),
        World("none-c", "none", Hidden(), ()),
        World("none-d", "none", Hidden(), ()),
        single("weak-joint-3", Hidden(strength={3: 0.6}), "weak-joint-joint3"),
        single("weak-joint-4", Hidden(strength={4: 0.5}), "weak-joint-joint4"),
        single("weak-joint-7", Hidden(strength={7: 0.3}), "weak-joint-joint7"),
        single("weak-joint-9", Hidden(strength={9: 0.45}), "weak-joint-joint9"),
        single("weak-joint-1", Hidden(strength={1: 0.4}), "weak-joint-joint1"),
        single("load", Hidden(load_kg={8: 0.12}), "link-mass-link8"),
        single("dry", Hidden(friction_n_m=0.15), "dry-friction"),
        single("tight-7", Hidden(friction_of_n_m={7: 0.5}), "joint-friction-joint7"),
        single("soft-4", Hidden(gain={4: 0.4}), "soft-joint-joint4"),
        single("carries", Hidden(carried_kg={"green": 0.15}), "payload-green", "link-mass-link10"),
        World("scale-and-weak", "two", Hidden(scale=0.03, strength={6: 0.5}), ("camera-scale", "weak-joint-joint6")),
    ]


def driven(world: World, seed: int, trials: int, cycles: int, camera: bool = False) -> pd.DataFrame:
    """A table of measurements: random controllers, a drive ends with a cycle that leaves the snake on its side."""
    rng = np.random.default_rng([seed, sum(map(ord, world.name))])
    rows: list[tuple[float, ...]] = []
    for trial in range(trials):
        snake = Snake(world.hidden, rng)
        snake.put_down()
        clock = 0.0
        for number, gait in enumerate(_gaits(rng, cycles), start=1):
            before, after, upright, lasted, between = snake.cycle(_postures(gait))
            rows.append((trial, clock, number, *gait, *before.ravel(), np.nan))
            if camera:
                nothing = (np.nan,) * 4
                inner = [(t, seen) for t, seen in between if 0 < t < lasted - 1e-6]
                rows += [(trial, clock + t, number, *nothing, *seen.ravel(), np.nan) for t, seen in inner]
            rows.append((trial, clock + lasted, number, *(np.nan,) * 4, *after.ravel(), float(upright)))
            clock += lasted + 0.5
            if snake.lies():
                break
    return pd.DataFrame(rows, columns=list(COLUMNS))


def write(world: World, folder: Path, seed: int, trials: int, cycles: int, camera: bool = False) -> Path:
    """The table as a file."""
    path = folder / f"{world.name}.parquet"
    driven(world, seed, trials, cycles, camera).to_parquet(path, index=False)
    return path


def _gaits(rng: np.random.Generator, cycles: int) -> Iterator[tuple[float, ...]]:
    """Lateral amplitude uniform, the vertical one below it (at most 95 %), two phases."""
    for _ in range(cycles):
        lateral = rng.uniform(0, np.pi / 2)
        yield lateral, lateral * rng.uniform(0, 0.95), *rng.uniform(0, 2 * np.pi, 2)


def _postures(gait: tuple[float, ...]) -> np.ndarray:
    lateral, vertical, omega, alpha = gait
    n, t = np.arange(12), np.arange(13)[:, None]
    theta = omega * n + 2 * np.pi / 12 * t
    return np.where(n % 2 == 0, lateral * np.sin(theta + alpha), vertical * np.sin(theta))
