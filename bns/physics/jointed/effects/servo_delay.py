"""Servos follow their set points after a delay: of the bus, the controller, or the servos' own processors."""

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
    parameters=(Parameter("delay_s", "s", -0.02, 1.0, (-0.02, 0.4), 0.0, "delay of the servos in addition to the model's"),),
    equation="set point'(t) = set point(t - delay)",
    residuals="Postures are reached late: visible at the camera's frame rate, or where a cycle ends before they are reached.",
    lookalikes=("servo-speed-limit", "clock-offset"),
    sentence="the servos follow with a longer delay than in the model",
    sized="the servos follow with a delay that is {delay_s:longer|shorter} than in the model",
    measurement="film a servo together with an LED that shows traffic on its bus",
    starts=((-0.01,), (0.02,), (0.08,), (0.24,)),
    apply=apply,
)
