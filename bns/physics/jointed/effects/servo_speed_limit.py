"""The speed of the servos is limited: they fall behind where successive postures are far apart."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, share: float) -> Plant:
    """The speed limit of every joint lowered to a fraction of the fastest commanded speed of any (`told_speed_rad_s`)."""
    return replace(plant, speed=plant.speed.clip(max=share))


EFFECT = Effect(
    name="servo-speed-limit",
    stage="mechanics",
    parameters=(
        Parameter(
            "share", "1", 0.02, 1.0, (0.15, 1.0), 1.0, "highest speed of a servo, as a fraction of the fastest commanded speed"
        ),
    ),
    equation="|d set point / dt| <= share * fastest commanded",
    residuals="Wide cycles move the robot less than predicted, small ones fit; postures are not reached.",
    lookalikes=("torque-limit", "servo-delay", "compliance"),
    sentence="the servos turn more slowly than commanded",
    measurement="let one servo turn freely from end to end and measure the time",
    starts=((0.79,), (0.49,), (0.3,), (0.19,)),
    apply=apply,
    revision=2,  # the share is of how fast set points move over half a second, no longer over a twentieth
)
