"""The speed of a wheel is limited."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels


def apply(wheels: Wheels, max_m_s: float) -> Wheels:
    """Each wheel's speed clipped to ±``max_m_s``."""
    return replace(
        wheels,
        left_m_s=np.clip(wheels.left_m_s, -max_m_s, max_m_s),
        right_m_s=np.clip(wheels.right_m_s, -max_m_s, max_m_s),
    )


EFFECT = Effect(
    name="speed-limit",
    stage="wheel",
    parameters=(Parameter("max_m_s", "m/s", 1e-3, math.inf, (0.02, 5.0), math.inf, "highest speed of a wheel"),),
    equation="w = min(max(u, -limit), limit) for each wheel",
    residuals="Fast commands fall short, slow ones fit; curves in which both wheels are fast become straighter.",
    lookalikes=("turn-slip", "acceleration-limit"),
    sentence="the speed of the wheels is limited",
    sized="no wheel runs faster than {max_m_s}",
    measurement="command full speed and log the wheels' own speeds (encoders)",
    apply=apply,
)
