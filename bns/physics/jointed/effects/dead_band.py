"""Servos give no torque while their error is smaller than a dead band: play of the gears, a wide compliance margin."""

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
    residuals="Small amplitudes move the robot less than predicted; large ones nearly as predicted.",
    lookalikes=("compliance", "dry-friction"),
    sentence="the servos have a wider dead band (more play) than the model's",
    measurement="turn a servo's arm back and forth by hand while it holds a position, and measure the play",
    starts=((0.03,), (0.09,)),
    apply=apply,
)
