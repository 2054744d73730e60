"""The motors' force limits the acceleration of the robot, whose wheels are joined by one body.

On a straight line each wheel moves half of the mass m, in a turn on the spot a part of the moment of inertia J. With the
force f of a wheel and the wheelbase b, the limits of a wheel's acceleration are 2·f/m and f·b^2/(2·J). Their ratio
m·b^2/(4·J) is 2 for a disc as wide as the wheelbase, and more for a load near the centre. At 1 each wheel is limited by
itself: `acceleration-limit`.
"""

from __future__ import annotations

import math

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels
from bns.physics.wheels.scans import limited_together


def apply(wheels: Wheels, max_m_s2: float, turn_ratio: float) -> Wheels:
    """Both wheels gain at most ``max_m_s2`` in one direction, ``turn_ratio`` times that in opposite ones."""
    if not math.isfinite(max_m_s2):
        return wheels
    return wheels.turning(
        *limited_together(wheels.left_m_s, wheels.right_m_s, wheels.step_s, max_m_s2, turn_ratio * max_m_s2)
    )


EFFECT = Effect(
    name="force-limit",
    stage="wheel",
    parameters=(
        Parameter(
            "max_m_s2", "m/s^2", 1e-3, math.inf, (0.02, 20.0), math.inf, "highest acceleration on a straight line"
        ),
        Parameter(
            "turn_ratio",
            "1",
            0.05,
            50.0,
            (0.2, 8.0),
            1.0,
            "highest acceleration of a wheel in turns on the spot, divided by that on straight lines",
        ),
    ),
    equation="|dw/dt| <= a where both wheels change in one direction, r·a in opposite ones, 2·a·r/(1 + r) if the other wheel "
    "keeps its speed",
    residuals="As with an acceleration limit, but turns lose less than straight lines, for they move the robot's inertia "
    "instead of its mass.",
    lookalikes=("acceleration-limit", "motor-lag"),
    sentence="the motors' force limits the acceleration, in turns otherwise than on straight lines",
    sized="the motors' force limits the acceleration to {max_m_s2} on straight lines; in turns the limit is "
    "{turn_ratio:higher|lower}",
    measurement="weigh the robot with its load; log the wheels' own speeds (encoders) while a command changes, ahead and on "
    "the spot",
    explained_by=("wheel_left_m_s", "wheel_right_m_s"),
    caveat="force-limit: tyres that slip limit the robot's acceleration as weak motors do, on a straight line to their "
    "coefficient of friction times 9.8 m/s^2. Log the wheels' own speeds (columns wheel_left_m_s and wheel_right_m_s): wheels "
    "that slip turn faster than the robot drives.",
    apply=apply,
    needs="track",
    extends="acceleration-limit",
)
