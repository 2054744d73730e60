"""What a rig says about the Khepera's driver: how long answers are waited for, and how long a stop is tried."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from bns.errors import HardwareError, unknown_name
from bns.hardware.link.reply_time import ReplyLimits

_REPLIES = {"first_reply_s": "first_s", "least_reply_s": "least_s", "most_reply_s": "most_s"}
_KNOWN = (*_REPLIES, "stop_s")
_MOST_S = 60.0
"""More would be no limit: a robot that has gone silent drives metres meanwhile."""


@dataclass(frozen=True)
class KheperaSettings:
    """Limits of the time-out for answers (`bns.hardware.link.reply_time`), and for how long a stop is tried."""

    reply: ReplyLimits = field(default_factory=ReplyLimits)
    stop_s: float = 5.0


def khepera_settings(driver: Mapping[str, Any]) -> KheperaSettings:
    """The settings in a rig's `driver`; HardwareError names one that is wrong."""
    if unknown := [name for name in driver if name not in _KNOWN]:
        raise HardwareError(f"the Khepera's driver: {unknown_name('setting', unknown[0], _KNOWN)}")
    for name, value in driver.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
            raise HardwareError(f"the Khepera's {name} is {value!r}; it must be a number of seconds above 0.")
        if value > _MOST_S:
            most = f"at most {_MOST_S:g}. It is in seconds, not milliseconds."
            raise HardwareError(f"the Khepera's {name} is {value:g} s; {most}")
    limits = ReplyLimits(**{ours: float(driver[name]) for name, ours in _REPLIES.items() if name in driver})
    if limits.least_s > limits.most_s:
        raise HardwareError(
            f"the Khepera's least_reply_s is {limits.least_s:g}, above its most_reply_s {limits.most_s:g}; it must be smaller."
        )
    return KheperaSettings(limits, float(driver.get("stop_s", KheperaSettings.stop_s)))
