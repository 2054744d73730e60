"""A wheel stands still while its command is below a threshold, and follows it above."""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels


def apply(wheels: Wheels, threshold_m_s: float) -> Wheels:
    """Each wheel's speed, nothing below ``threshold_m_s``."""
    left, right = (np.where(np.abs(u) < threshold_m_s, 0.0, u) for u in (wheels.left_m_s, wheels.right_m_s))
    return wheels.turning(left, right)


EFFECT = Effect(
    name="dead-band",
    stage="wheel",
    parameters=(
        Parameter(
            "threshold_m_s",
            "m/s",
            0.0,
            1.0,
            (0.0, 0.1),
            0.0,
            "command below which a wheel stands still",
            size_power=1.0,
            resolution=5e-4,
            jagged=True,
        ),
    ),
    equation="w = u where |u| > t, else 0, for each wheel",
    residuals="Slow commands are not driven at all, and all others as commanded: turns in which the inner wheel is slow are too "
    "sharp.",
    lookalikes=("dead-zone", "stribeck", "breakaway"),
    sentence="a wheel stands still while its command is below a threshold",
    sized="a wheel stands still while its command is below {threshold_m_s}",
    measurement="lift the robot, raise one wheel's command slowly from zero, and note the command at which the wheel begins to "
    "turn, and at once how fast it turns then",
    apply=apply,
    revision=2,
    needs="track",
    starts=tuple((round(0.003 * 1.07**i, 5),) for i in range(52)),
)
