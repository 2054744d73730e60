"""What a rig says about the snake's driver: how the servos are wired, how fast they turn, what they must keep."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from bns.errors import HardwareError, unknown_name
from bns.hardware.servos.servo_chain import REFUSED_V, ServoLimits
from bns.physics.snake.parameters import shipped_parameters

WIRINGS = ("bus", "bridge")
"""A bus adapter that the servos hang on, or an Arduino in between (docs/bridge.md)."""
_LIMITS = tuple(limit.name for limit in dataclasses.fields(ServoLimits))


@dataclass(frozen=True)
class SnakeSettings:
    """Wiring; ids of the servos from the yellow end to the green one; speed of the joints; pause after each posture."""

    wiring: str
    ids: tuple[int, ...]
    joint_speed_rad_s: float
    settle_s: float
    limits: ServoLimits = field(default_factory=ServoLimits)


def snake_settings(driver: Mapping[str, Any]) -> SnakeSettings:
    """The settings in a rig's `driver`; HardwareError names one that is wrong. What is not given is as in the physics model."""
    model = shipped_parameters()
    known = ("wiring", "ids", "joint_speed_rad_s", "settle_s", *_LIMITS)
    if unknown := [name for name in driver if name not in known]:
        raise HardwareError(f"the snake's driver: {unknown_name('setting', unknown[0], known)}")
    wiring = driver.get("wiring", "bus")
    if wiring not in WIRINGS:
        raise HardwareError(unknown_name("wiring of the snake", wiring, WIRINGS))
    limits = ServoLimits(**{name: _number(name, driver[name]) for name in _LIMITS if name in driver})
    if not 0.0 < limits.torque <= 1.0:
        raise HardwareError(f"the snake's torque is {limits.torque:g}; it is a share of the servos' highest, above 0 up to 1.")
    if limits.high_v >= REFUSED_V:
        raise HardwareError(f"the snake's high_v is {limits.high_v:g}; the servos' makers allow 12 V.")
    return SnakeSettings(
        wiring,
        _ids(driver.get("ids", list(range(1, model.joints + 1))), model.joints),
        _number("joint_speed_rad_s", driver.get("joint_speed_rad_s", model.joint_speed_rad_s)),
        _number("settle_s", driver.get("settle_s", model.settle_s)),
        limits,
    )


def _ids(given: Any, joints: int) -> tuple[int, ...]:
    good = isinstance(given, list) and all(type(number) is int and 0 <= number <= 253 for number in given)
    if not good or len(set(given)) != joints or len(given) != joints:
        raise HardwareError(
            f"the snake's ids are {given!r}; give {joints} different whole numbers from 0 to 253, yellow end first."
        )
    return tuple(given)


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
        raise HardwareError(f"the snake's {name} is {value!r}; it must be a number above 0.")
    return float(value)
