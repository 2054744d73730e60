"""What the snake's physics is made of: one number a line of ``parameters.yaml``, with its basis and reason."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from bns.errors import ModelError, unknown_name
from bns.physics.effect import number
from bns.safe_yaml import read_yaml, shown

BASIS = ("measured", "published", "fitted", "guess")
"""How a value came to be known."""
READINGS = ("tether_at_yellow", "tipped_on_the_way_fails", "tipped_on_the_way_ends", "roles_switch_on_side")
"""Parameters that are 1 or 0: where the dissertation can be read in two ways."""


def _within(low: float, high: float) -> Any:
    return dataclasses.field(metadata={"low": low, "high": high})


@dataclass(frozen=True)
class SnakeParameters:
    """Body, servos, floor, camera and thresholds, in SI units; `parameters.yaml` says where each value comes from."""

    links: float = _within(4, 40)
    pitch_m: float = _within(0.01, 1.0)
    radius_m: float = _within(0.002, 0.2)
    body_mass_kg: float = _within(0.01, 50.0)
    tail_mass_kg: float = _within(0.0, 10.0)
    tether_drag_n: float = _within(0.0, 10.0)
    tether_at_yellow: float = _within(0.0, 1.0)
    marker_gap_m: float = _within(0.01, 10.0)
    torque_limit_n_m: float = _within(0.01, 100.0)
    stiffness_n_m_rad: float = _within(0.01, 1000.0)
    damping_n_m_s_rad: float = _within(0.0, 100.0)
    armature_kg_m2: float = _within(0.0, 1.0)
    friction_loss_n_m: float = _within(0.0, 10.0)
    dead_band_rad: float = _within(0.0, 0.5)
    resolution_rad: float = _within(0.0, 0.5)
    delay_s: float = _within(0.0, 1.0)
    joint_speed_rad_s: float = _within(0.01, 20.0)
    settle_s: float = _within(0.0, 10.0)
    floor_friction: float = _within(0.01, 3.0)
    friction_spread: float = _within(0.0, 0.3)
    link_friction_spread: float = _within(0.0, 1.0)
    floor_tilt_rad: float = _within(0.0, 0.2)
    marker_noise_m: float = _within(0.0, 0.1)
    tipped_rad: float = _within(0.1, 3.2)
    tipped_on_the_way_fails: float = _within(0.0, 1.0)
    tipped_on_the_way_ends: float = _within(0.0, 1.0)
    roles_switch_on_side: float = _within(0.0, 1.0)
    stalled_s: float = _within(0.0, 10.0)
    collision_n: float = _within(0.0, 100.0)
    dt_s: float = _within(1e-5, 0.02)

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = number(f"snake: {field.name}", getattr(self, field.name), **field.metadata)
            object.__setattr__(self, field.name, value)
        self._check_body()

    def _check_body(self) -> None:
        """ModelError for numbers that are allowed each by itself, but are no body together."""
        if self.links != int(self.links):
            raise ModelError(f"snake: links is {self.links:g}; it must be a whole number.")
        for name in READINGS:
            if getattr(self, name) not in (0.0, 1.0):
                raise ModelError(f"snake: {name} is {getattr(self, name):g}; it is a reading: give 1 (yes) or 0 (no).")
        if self.pitch_m <= 2 * self.radius_m:
            raise ModelError(
                f"snake: pitch_m is {self.pitch_m:g} and radius_m {self.radius_m:g}; a link must be longer than it is wide: "
                "pitch_m must be more than twice radius_m."
            )
        if self.marker_gap_m >= self.length_m:
            raise ModelError(
                f"snake: marker_gap_m is {self.marker_gap_m:g}; it must be less than the body's length, "
                f"links times pitch_m = {self.length_m:g}."
            )

    @property
    def joints(self) -> int:
        """Servos: one between each two links."""
        return int(self.links) - 1

    @property
    def joints_between_markers(self) -> slice:
        """Joint k is between links k and k + 1; the joints beyond swing an end of the body, and move no marker by themselves."""
        return slice(*(int((self.length_m + sign * self.marker_gap_m) / 2 / self.pitch_m) for sign in (-1, 1)))

    @property
    def heavy_link(self) -> int:
        """The link that carries the Arduino and drags the tether: the first is at yellow's end, the last at green's."""
        return 0 if self.tether_at_yellow else int(self.links) - 1

    @property
    def length_m(self) -> float:
        """Length of the straight body."""
        return int(self.links) * self.pitch_m

    @property
    def digest(self) -> str:
        """SHA-256 of all numbers, 20 hexadecimal digits."""
        return hashlib.sha256(json.dumps(dataclasses.asdict(self), sort_keys=True).encode()).hexdigest()[:20]


def read_parameters(text: str) -> SnakeParameters:
    """Parameters of a YAML text; ModelError names an entry that is missing, unknown or without its basis and reason."""
    content, _ = read_yaml(text, "the snake's parameters", ModelError)
    names = [field.name for field in dataclasses.fields(SnakeParameters)]
    if not isinstance(content, dict):
        raise ModelError(f"the snake's parameters are no mapping; give {', '.join(names)}.")
    for name, entry in content.items():
        if name not in names:
            raise ModelError(unknown_name("parameter of the snake", name, names))
        if not isinstance(entry, dict) or set(entry) != {"value", "basis", "reason"}:
            raise ModelError(f"the snake's {name} is {shown(entry)}; it needs value, basis and reason.")
        if entry["basis"] not in BASIS:
            raise ModelError(unknown_name(f"basis of the snake's {name}", entry["basis"], BASIS))
    if missing := [name for name in names if name not in content]:
        raise ModelError(f"the snake's parameters lack {', '.join(missing)}; add them with value, basis and reason.")
    return SnakeParameters(**{name: content[name]["value"] for name in names})


@cache
def shipped_parameters() -> SnakeParameters:
    """The parameters that ship in the package."""
    return read_parameters(shipped_text())


def shipped_text() -> str:
    """The file that they stand in, each with its basis and reason."""
    return (Path(str(resources.files(__package__))) / "parameters.yaml").read_text(encoding="utf-8")
