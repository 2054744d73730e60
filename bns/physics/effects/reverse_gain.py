"""Wheels run faster or slower backwards than forwards: brushes set for one direction, a gear's worn flanks, a drive's table."""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels


def apply(wheels: Wheels, gain: float) -> Wheels:
    """Each speed times ``gain`` where it is negative."""
    return wheels.turning(_scaled(wheels.left_m_s, gain), _scaled(wheels.right_m_s, gain))


def _scaled(speed: Array, gain: float) -> Array:
    return np.where(speed < 0.0, gain * speed, speed)


EFFECT = Effect(
    name="reverse-gain",
    stage="wheel",
    parameters=(
        Parameter("gain", "1", 0.2, 5.0, (0.5, 1.5), 1.0, "true divided by commanded speed of a wheel that turns backwards"),
    ),
    equation="w = g·u where u < 0, for each wheel",
    residuals="Forward commands fit; backward ones are wrong by one fraction; turns on the spot move the robot along.",
    lookalikes=("speed-gain", "marker-offset"),
    sentence="wheels run faster or slower backwards than forwards",
    sized="wheels turn {gain:faster|slower} backwards than forwards",
    measurement="drive a straight line forwards and the same backwards: the tape measure says how they differ",
    apply=apply,
)
