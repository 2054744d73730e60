"""What a rig says about the snake's driver: how the servos are wired, how fast they turn, what they must keep."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from bns.errors import HardwareError, unknown_name
from bns.hardware.servos.ax12_table import AX12
from bns.hardware.servos.servo_chain import ServoLimits
from bns.hardware.servos.servo_models import TABLES
from bns.hardware.servos.servo_table import ServoTable
from bns.physics.snake.parameters import shipped_parameters

WIRINGS = ("bus", "bridge")
"""A bus adapter that the servos hang on, or an Arduino in between (docs/bridge.md)."""
_CHARGED_V = 0.5
"""Above what the makers allow: for the servo's own reading, and for a battery that has just been charged."""
_REFUSED_V = 1.0
"""So much above it, no rig may allow."""
_MOST: Mapping[str, tuple[float, str]] = {
    "settle_s": (10.0, "in seconds, not milliseconds"),
    "stalled_s": (10.0, "in seconds, not milliseconds"),
    "stuck_s": (10.0, "in seconds, not milliseconds"),
    "temperature_c": (85.0, "in degrees Celsius"),
    "load": (1.0, "a fraction of the permitted torque"),
}
"""More would be no limit, or wait for ever; and the unit in which it was most likely not meant."""
_LIMITS = tuple(limit.name for limit in dataclasses.fields(ServoLimits))


@dataclass(frozen=True)
class SnakeSettings:
    """Wiring; ids of the servos from the yellow end to the green one; speed of the joints; pause after each posture."""

    wiring: str
    ids: tuple[int, ...]
    joint_speed_rad_s: float
    settle_s: float
    limits: ServoLimits = field(default_factory=ServoLimits)
    table: ServoTable = AX12


def snake_settings(driver: Mapping[str, Any]) -> SnakeSettings:
    """The settings in a rig's `driver`; HardwareError names one that is wrong. What is not given is as in the physics model."""
    model = shipped_parameters()
    known = ("wiring", "protocol", "model", "ids", "joint_speed_rad_s", "settle_s", *_LIMITS)
    if unknown := [name for name in driver if name not in known]:
        raise HardwareError(f"the snake's driver: {unknown_name('setting', unknown[0], known)}")
    wiring = driver.get("wiring", "bus")
    if wiring not in WIRINGS:
        raise HardwareError(unknown_name("wiring of the snake", wiring, WIRINGS))
    table = _table(driver)
    if wiring == "bridge" and table is not AX12:
        raise HardwareError(f"the bridge's sketch drives AX-12 servos only, and the rig says {table.model}; use wiring: bus.")
    limits = replace(limits_of(table), **{name: _number(name, driver[name]) for name in _LIMITS if name in driver})
    if not 0.0 < limits.torque <= 1.0:
        raise HardwareError(f"the snake's torque is {limits.torque:g}; it is a fraction of the servos' highest, above 0 up to 1.")
    if limits.high_v >= table.volts[1] + _REFUSED_V:
        raise HardwareError(f"the snake's high_v is {limits.high_v:g}; the servos' makers allow {table.volts[1]:g} V.")
    if limits.low_v >= limits.high_v:
        raise HardwareError(f"the snake's low_v is {limits.low_v:g}, and high_v {limits.high_v:g}; low_v must be the lower one.")
    speed_rad_s = _number("joint_speed_rad_s", driver.get("joint_speed_rad_s", model.joint_speed_rad_s))
    if speed_rad_s > table.no_load_rad_s:
        fastest = f"without load the {table.model} turns at {table.no_load_rad_s:.1f}. It is in radians a second, not degrees."
        raise HardwareError(f"the snake's joint_speed_rad_s is {speed_rad_s:g}; {fastest}")
    return SnakeSettings(
        wiring,
        _ids(driver.get("ids", list(range(1, model.joints + 1))), model.joints),
        speed_rad_s,
        _number("settle_s", driver.get("settle_s", model.settle_s)),
        limits,
        table,
    )


def limits_of(table: ServoTable) -> ServoLimits:
    """What servos of this model must keep, unless a rig says otherwise."""
    return ServoLimits(low_v=table.volts[0], high_v=table.volts[1] + _CHARGED_V)


def _table(driver: Mapping[str, Any]) -> ServoTable:
    """By protocol and model; an AX-12 unless the rig says otherwise."""
    protocol = driver.get("protocol", 1)
    models = [name for name, table in TABLES.items() if table.protocol == protocol]
    if isinstance(protocol, bool) or not models:
        raise HardwareError(f"the snake's protocol is {protocol!r}; its servos speak 1 (AX-12) or 2 (XL430, XM430).")
    if protocol == 2 and "model" not in driver:
        raise HardwareError(f"the snake's driver has protocol 2 and no model; give one of {', '.join(models)}.")
    model = driver.get("model", models[0])
    if model not in models:
        raise HardwareError(unknown_name("model of the snake's servos", str(model), models))
    return TABLES[model]


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
    most, unit = _MOST.get(name, (math.inf, ""))
    if value > most:
        raise HardwareError(f"the snake's {name} is {value:g}; at most {most:g}. It is {unit}.")
    return float(value)
