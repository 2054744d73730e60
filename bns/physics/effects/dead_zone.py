"""Friction takes a constant amount from the speed of each wheel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels


def apply(wheels: Wheels, width_m_s: float) -> Wheels:
    """Each wheel's speed reduced towards zero by ``width_m_s``, and not beyond zero."""
    return replace(wheels, left_m_s=shrunk(wheels.left_m_s, width_m_s), right_m_s=shrunk(wheels.right_m_s, width_m_s))


def shrunk(speed: Array, width: Array | float) -> Array:
    """A speed reduced towards zero by ``width``, and not beyond zero."""
    return np.sign(speed) * np.maximum(np.abs(speed) - width, 0.0)


EFFECT = Effect(
    name="dead-zone",
    stage="wheel",
    parameters=(
        Parameter("width_m_s", "m/s", 0.0, 1.0, (0.0, 0.1), 0.0, "speed that each wheel loses to friction", size_power=1.0),
    ),
    equation="w = sign(u)·max(|u| - d, 0) for each wheel",
    residuals="Slow commands fall short by a larger fraction than fast ones; the error is proportional "
    "to their duration. A wheel commanded below the dead zone stands still.",
    lookalikes=("speed-gain", "motor-lag"),
    sentence="every wheel loses a constant part of its speed to friction",
    sized="every wheel loses {width_m_s} of its speed to friction",
    measurement="lift the robot, raise one wheel's command slowly from zero, and note the command at which the "
    "wheel begins to turn",
    apply=apply,
)
