"""Servos follow late: the bus, the controller, the servos' own processors."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, delay_s: float) -> Plant:
    """The delay of all joints added."""
    return replace(plant, delay_s=plant.delay_s + delay_s)


EFFECT = Effect(
    name="servo-delay",
    stage="mechanics",
    parameters=(Parameter("delay_s", "s", -0.02, 1.0, (-0.02, 0.4), 0.0, "delay of the servos beyond the model's"),),
    equation="set point'(t) = set point(t - delay)",
    residuals="Postures are reached too late: seen at the camera's rate, and where a cycle ends before they are.",
    lookalikes=("servo-speed-limit", "clock-offset"),
    sentence="the servos follow later than assumed",
    measurement="film a servo and the lamp of its bus together",
    starts=((-0.01,), (0.08,), (0.24,)),
    apply=apply,
)
