"""The robot turns by itself while it drives."""

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
    parameters=(Parameter("rate_rad_s", "rad/s", -2.0, 2.0, (-0.5, 0.5), 0.0, "turning rate added, left positive"),),
    equation="omega' = omega + beta while moving",
    residuals="The heading drifts to one side in proportion to the time driven, whatever the speed; also in reverse.",
    lookalikes=("wheel-mismatch",),
    sentence="the robot turns a little to one side whenever it moves",
    measurement="lift the robot and log both wheels' own speeds (encoders)",
    apply=apply,
)
