"""A constant turn rate is added while the robot drives."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body


def apply(body: Body, rate_rad_s: float) -> Body:
    """A constant added to omega while the wheels turn."""
    return replace(body, yaw_rad_s=body.yaw_rad_s + rate_rad_s * body.moving)


EFFECT = Effect(
    name="yaw-bias",
    stage="body",
    parameters=(Parameter("rate_rad_s", "rad/s", -2.0, 2.0, (-0.5, 0.5), 0.0, "turn rate added, counter-clockwise positive"),),
    equation="omega' = omega + beta while moving",
    residuals="The heading drifts to one side in proportion to the time driven, at any speed and also in reverse.",
    lookalikes=("wheel-mismatch",),
    sentence="the robot turns to one side at a constant rate whenever it moves",
    sized="the robot turns {rate_rad_s:to the left|to the right} whenever it moves",
    measurement="lift the robot, command equal speeds, and log both wheels' own speeds (encoders)",
    revision=2,
    apply=apply,
)
