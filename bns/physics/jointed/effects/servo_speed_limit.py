"""Servos turn no faster than this, though they are told to: they lag behind where postures are far apart."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, share: float) -> Plant:
    """The limit of every joint's speed lowered to a share of what it is told."""
    return replace(plant, speed=plant.speed.clip(max=share))


EFFECT = Effect(
    name="servo-speed-limit",
    stage="mechanics",
    parameters=(
        Parameter(
            "share", "1", 0.1, 1.0, (0.3, 1.0), 1.0, "highest speed of a servo, as a share of the fastest it is told"
        ),
    ),
    equation="|d set point / dt| <= share * told",
    residuals="Wide cycles move less than foreseen, small ones fit; postures are not reached.",
    lookalikes=("torque-limit", "servo-delay", "compliance"),
    sentence="the servos turn more slowly than they are told to",
    measurement="let one servo turn freely from end to end and take the time",
    starts=((0.86,), (0.58,), (0.3,)),
    apply=apply,
)
