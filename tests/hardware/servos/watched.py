"""What tests of servos on a bus have in common."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any


def speeds_under_torque(servos: Iterable[Any]) -> dict[int, set[int]]:
    """Identifier -> every speed that a servo is set to while its torque is on; filled as it is written to."""
    speeds: dict[int, set[int]] = {}
    for servo in servos:

        def watched(address: Any, data: Any, servo: Any = servo, write: Any = servo.write) -> Any:
            refused = write(address, data)
            if servo.get("torque_enable"):
                speeds.setdefault(servo.get("id"), set()).add(servo.get("moving_speed"))
            return refused

        servo.write = watched
    return speeds
