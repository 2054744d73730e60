"""A rig: which robot stands at which port, what sees it, and where it may go. One YAML file for each laboratory set-up."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bns.errors import HardwareError, unknown_name
from bns.hardware.safety import Limits, Surface
from bns.registry import PLATFORMS, TRACKERS
from bns.safe_yaml import Lines, read_yaml, shown, text_of

PLACED_RAD = 0.35
"""Twenty degrees: as hands place a robot, and no further."""
_NEEDED = ("robot", "port", "surface_m", "tracker")
_MOST_S = {"lost_s": 10.0, "picture_s": 10.0, "disagree_s": 10.0, "late_s": 30.0, "silent_s": 30.0, "gives_up_s": 7 * 86400.0}
"""More would be no limit: a robot drives metres meanwhile. Most likely it was meant in milliseconds."""
_MOST_M = 100.0
"""A longer surface was most likely meant in centimetres or millimetres."""
_MOST_RAD = 3.15
"""Half a turn, rounded up. More is no limit, and most likely degrees."""
_KEYS = (*_NEEDED, *_MOST_S, "placed_within_m", "placed_within_rad", "driver")


@dataclass(frozen=True)
class Rig:
    """A set-up. `tracker` has a `kind` and that kind's own settings, `driver` the settings of the robot's driver.

    A robot further than `placed_within_m` from its start, or turned by more than `placed_within_rad`, is put back before a drive.
    """

    robot: str
    port: str
    tracker: Mapping[str, Any]
    limits: Limits
    placed_within_m: float = 0.1
    driver: Mapping[str, Any] = field(default_factory=dict)
    placed_within_rad: float = PLACED_RAD

    def check_task(self, goals_m: np.ndarray) -> None:
        """HardwareError if a goal lies off the surface."""
        for x_m, y_m in goals_m:
            if not self.limits.surface.holds(x_m, y_m):
                raise HardwareError(
                    f"the task has a goal at ({x_m:.2f}, {y_m:.2f}) m, off the surface "
                    f"{surface_text(self.limits.surface)}; take a smaller task or change surface_m in the rig."
                )


def surface_text(surface: Surface) -> str:
    """The surface in words."""
    return f"x {surface.x_low_m:g} to {surface.x_high_m:g} m, y {surface.y_low_m:g} to {surface.y_high_m:g} m"


def shipped_rig(robot: str) -> Rig:
    """The example rig of a robot, which `--emulated` uses."""
    return parse_rig(PLATFORMS.load(robot).RIG.read_text(encoding="utf-8"), f"the shipped rig of {robot}")


def load_rig(path: Path, robot: str | None = None) -> Rig:
    """A rig from a file, of any robot or of this one; HardwareError names what is wrong, or that it is another robot's."""
    rig = parse_rig(text_of(path, "the rig", HardwareError), str(path))
    if robot not in (None, rig.robot):
        raise HardwareError(f"{path} is a rig for {rig.robot}, and the trial is for {robot}; name the other with --robot.")
    return rig


def parse_rig(text: str, where: str) -> Rig:
    """The rig in a YAML text; `where` is for messages."""
    content, lines = read_yaml(text, where, HardwareError)
    if not isinstance(content, dict):
        raise HardwareError(f"{where} is no rig; it needs {', '.join(_NEEDED)}.")
    unknown = [key for key in content if key not in _KEYS]
    if unknown:
        raise HardwareError(f"{where}, line {lines.of(unknown[0])}: {unknown_name('key', unknown[0], _KEYS)}")
    missing = [key for key in _NEEDED if key not in content]
    if missing:
        raise HardwareError(f"{where} lacks {', '.join(missing)}; it needs {', '.join(_NEEDED)}.")
    return _rig(content, where, lines)


def _rig(content: Mapping[str, Any], where: str, lines: Lines) -> Rig:
    at = {key: f"{where}, line {lines.of(key)}" for key in content}
    tracker = content["tracker"]
    if not isinstance(tracker, dict) or not isinstance(tracker.get("kind"), str):
        raise HardwareError(
            f"{at['tracker']}: tracker is {shown(tracker)}; it needs a kind ({', '.join(TRACKERS.names())}) and its settings."
        )
    numbers = {name: _seconds(at[name], name, content[name]) for name in _MOST_S if name in content}
    limits = Limits(_surface(at["surface_m"], content["surface_m"]), **numbers)
    near_m = _positive(at.get("placed_within_m", where), "placed_within_m", content.get("placed_within_m", 0.1))
    near_rad = _positive(at.get("placed_within_rad", where), "placed_within_rad", content.get("placed_within_rad", PLACED_RAD))
    driver = content.get("driver") or {}
    if not isinstance(driver, dict):
        raise HardwareError(
            f"{at['driver']}: driver is {shown(driver)}; it holds the settings of the robot's driver, name: value."
        )
    if near_rad > _MOST_RAD:
        most = "at most π. It is in radians, not degrees: 20° are 0.35."
        raise HardwareError(f"{at['placed_within_rad']}: placed_within_rad is {near_rad:g}; {most}")
    surface = limits.surface
    longest_m = max(surface.x_high_m - surface.x_low_m, surface.y_high_m - surface.y_low_m)
    if "placed_within_m" in content and near_m > longest_m:
        most = f"at most {longest_m:g}, the length of surface_m. It is in metres."
        raise HardwareError(f"{at['placed_within_m']}: placed_within_m is {near_m:g}; {most}")
    return Rig(str(content["robot"]), str(content["port"]), tracker, limits, near_m, driver, near_rad)


def _surface(where: str, given: Any) -> Surface:
    try:
        (x_low, x_high), (y_low, y_high) = given["x"], given["y"]
        sides = (x_low, x_high, y_low, y_high)
        surface = Surface(*map(_side, sides))
    except (TypeError, KeyError, ValueError, OverflowError) as error:
        raise HardwareError(f"{where}: surface_m is {shown(given)}; write {{x: [-0.9, 0.9], y: [-0.7, 0.7]}}, metres.") from error
    ordered = surface.x_low_m < surface.x_high_m and surface.y_low_m < surface.y_high_m
    if not ordered or not all(map(math.isfinite, sides)):
        raise HardwareError(f"{where}: surface_m is {shown(given)}; the first number of x and of y must be the smaller one.")
    longest_m = max(surface.x_high_m - surface.x_low_m, surface.y_high_m - surface.y_low_m)
    if longest_m > _MOST_M:
        raise HardwareError(f"{where}: surface_m is {longest_m:g} m long; at most {_MOST_M:g}. Its numbers are in metres.")
    return surface


def _side(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{value!r} is no number")
    return float(value)


def _seconds(where: str, name: str, value: Any) -> float:
    seconds = _positive(where, name, value)
    if seconds > _MOST_S[name]:
        most = f"at most {_MOST_S[name]:g} s. It is in seconds, not milliseconds."
        raise HardwareError(f"{where}: {name} is {shown(value)} s; {most}")
    return seconds


def _positive(where: str, name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
        raise HardwareError(f"{where}: {name} is {shown(value)}; it must be a number above 0.")
    return float(value)
