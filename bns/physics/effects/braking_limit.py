"""A wheel may slow down faster, or less fast, than it may speed up: two limits of its acceleration.

Drives have a setting for each. With both alike: `acceleration-limit`.
"""

from __future__ import annotations

import math
from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels
from bns.physics.wheels.braking import limited


def apply(wheels: Wheels, max_m_s2: float, brake_ratio: float) -> Wheels:
    """Each wheel speeds up by at most ``max_m_s2`` and slows down by at most ``brake_ratio`` times that, from rest."""
    if not math.isfinite(max_m_s2):
        return wheels
    brake = max_m_s2 * brake_ratio
    return replace(
        wheels,
        left_m_s=limited(wheels.left_m_s, wheels.step_s, max_m_s2, brake),
        right_m_s=limited(wheels.right_m_s, wheels.step_s, max_m_s2, brake),
    )


EFFECT = Effect(
    name="braking-limit",
    stage="wheel",
    parameters=(
        Parameter("max_m_s2", "m/s^2", 1e-3, math.inf, (0.02, 20.0), math.inf, "highest acceleration of a wheel"),
        Parameter("brake_ratio", "1", 0.02, 50.0, (0.2, 5.0), 1.0, "highest deceleration of a wheel, divided by that"),
    ),
    equation="|dw/dt| <= a while |w| rises, r·a while it falls, for each wheel",
    residuals="As with a limit of the acceleration, but a stop takes another way than a start from rest to the same speed.",
    lookalikes=("acceleration-limit", "braking-lag"),
    sentence="the wheels' acceleration is limited, otherwise while they slow down",
    sized="no wheel speeds up faster than by {max_m_s2}, and the limit is {brake_ratio:higher|lower} while it slows down",
    measurement="read the limits of acceleration and deceleration in the settings of the drive, or log the wheels' own speeds "
    "(encoders) from rest to a speed and back",
    apply=apply,
    needs="track",
    extends="acceleration-limit",
)
