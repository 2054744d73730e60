"""Servos do nothing while they are nearer to where they should be than this: play of the gear, a wide compliance margin."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, band_rad: float) -> Plant:
    """The band of all joints widened."""
    return replace(plant, dead_band_rad=plant.dead_band_rad + band_rad)


EFFECT = Effect(
    name="dead-band",
    stage="mechanics",
    parameters=(
        Parameter("band_rad", "rad", -0.01, 0.4, (0.0, 0.15), 0.0, "dead band of the servos beyond the model's"),
    ),
    equation="torque = 0 while |error| < band",
    residuals="Small amplitudes move less than foreseen, large ones by nearly the same.",
    lookalikes=("compliance",),
    sentence="the servos have more play than assumed",
    measurement="turn a servo's arm by hand to and fro while it holds a position, and measure the play",
    starts=((0.03,), (0.09,)),
    apply=apply,
)
