"""Friction takes a constant amount from the speed of each wheel, more from one than from the other: a dry or a tight bearing.

Where both lose the same: `dead-zone`.
"""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.dead_zone import EFFECT as ALIKE
from bns.physics.effects.dead_zone import shrunk
from bns.physics.signals import Wheels


def apply(wheels: Wheels, width_m_s: float, left_share: float) -> Wheels:
    """The left wheel loses ``left_share``·``width_m_s``, the right one (2 - ``left_share``)·``width_m_s``, never beyond 0."""
    return wheels.turning(
        shrunk(wheels.left_m_s, width_m_s * left_share), shrunk(wheels.right_m_s, width_m_s * (2.0 - left_share))
    )


EFFECT = Effect(
    name="dead-zone-mismatch",
    stage="wheel",
    parameters=(
        *ALIKE.parameters,
        Parameter(
            "left_share",
            "1",
            0.0,
            2.0,
            (0.0, 2.0),
            1.0,
            "speed lost on the left, divided by the mean of both sides (0: only the right wheel loses, 2: only the left)",
            reached=(0.0, 2.0),
        ),
    ),
    equation="w = sign(u)·max(|u| - g·d, 0) on the left, 2 - g in the place of g on the right",
    residuals="The robot turns to one side forwards and to the same side of its own backwards, slow commands most.",
    lookalikes=("dead-zone", "wheel-mismatch", "yaw-bias"),
    sentence="friction takes more speed from one wheel than from the other",
    sized="friction takes {width_m_s} of speed from a wheel on average, more from {left_share:the left|the right|side} one",
    measurement="lift the robot, raise each wheel's command slowly from zero, and note the command at which it begins to turn",
    apply=apply,
    extends="dead-zone",
)
