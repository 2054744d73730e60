"""A wheel stands still while its command is below a threshold, and follows it above."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels

_SHARPNESS = 250
"""From 0.1 to 0.9 of the command within 0.9 % of the threshold either way: a fit needs a slope."""


def apply(wheels: Wheels, threshold_m_s: float) -> Wheels:
    """Each wheel's speed, next to nothing below ``threshold_m_s``."""
    return replace(
        wheels,
        left_m_s=_above(wheels.left_m_s, threshold_m_s),
        right_m_s=_above(wheels.right_m_s, threshold_m_s),
    )


def _above(speed: Array, threshold: float) -> Array:
    beyond = np.minimum(threshold / np.maximum(np.abs(speed), 1e-9), 2.0)
    out: Array = speed / (1.0 + beyond**_SHARPNESS)
    return out


EFFECT = Effect(
    name="dead-band",
    stage="wheel",
    parameters=(
        Parameter(
            "threshold_m_s", "m/s", 0.0, 1.0, (0.0, 0.1), 0.0, "command below which a wheel stands still", size_power=1.0
        ),
    ),
    equation="w = u where |u| > t, else 0, for each wheel",
    residuals="Slow commands are not driven at all, and all others as commanded: turns in which the inner wheel is slow are too "
    "sharp.",
    lookalikes=("dead-zone", "stribeck"),
    sentence="a wheel stands still while its command is below a threshold",
    measurement="lift the robot, raise one wheel's command slowly from zero, and note the command at which the wheel begins to "
    "turn, and at once how fast it turns then",
    apply=apply,
    needs="track",
    starts=tuple((round(0.003 * 1.07**i, 5),) for i in range(52)),
)
