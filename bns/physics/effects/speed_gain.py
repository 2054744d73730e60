"""Both wheels run faster or slower than commanded by one factor."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels


def apply(wheels: Wheels, gain: float) -> Wheels:
    """Both speeds times ``gain``."""
    return replace(wheels, left_m_s=wheels.left_m_s * gain, right_m_s=wheels.right_m_s * gain)


EFFECT = Effect(
    name="speed-gain",
    stage="wheel",
    parameters=(
        Parameter(
            "gain", "1", 0.2, 5.0, (0.5, 1.5), 1.0, "true divided by commanded speed (or wheel diameter)"
        ),
    ),
    equation="l' = g·l, r' = g·r",
    residuals="Distances and turns are wrong by the same fraction in every command, whatever its speed and duration.",
    lookalikes=("motor-lag", "dead-zone", "turn-slip"),
    sentence="both wheels turn faster or slower than commanded, by one factor",
    sized="both wheels turn {gain:faster|slower} than commanded",
    measurement="drive straight and measure the distance on the floor with a tape measure",
    apply=apply,
)
