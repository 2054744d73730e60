"""Stribeck friction: it is highest at rest and falls with speed, so that only a slow wheel loses speed."""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels


def apply(wheels: Wheels, width_m_s: float, fade_m_s: float) -> Wheels:
    """Each wheel's speed reduced towards zero by ``width_m_s``·exp(-|u|/``fade_m_s``), and not beyond zero."""
    left, right = (_braked(speed, width_m_s, fade_m_s) for speed in (wheels.left_m_s, wheels.right_m_s))
    return wheels.turning(left, right)


def _braked(speed: Array, width: float, fade: float) -> Array:
    size = np.abs(speed)
    out: Array = np.sign(speed) * np.maximum(size - width * np.exp(-size / fade), 0.0)
    return out


EFFECT = Effect(
    name="stribeck",
    stage="wheel",
    parameters=(
        Parameter(
            "width_m_s", "m/s", 0.0, 1.0, (0.0, 0.15), 0.0, "speed lost by a wheel near rest", size_power=1.0
        ),
        Parameter(
            "fade_m_s", "m/s", 1e-3, 5.0, (2e-3, 0.5), 0.05, "speed at which the loss has fallen to 37 %", size_power=1.0
        ),
    ),
    equation="w = sign(u)·max(|u| - d·exp(-|u|/f), 0) for each wheel",
    residuals="Slow commands fall short; the loss vanishes as speed grows, so that fast commands fit.",
    lookalikes=("dead-zone", "speed-gain"),
    sentence="friction brakes slow wheels more than fast ones",
    sized="friction takes {width_m_s} of its speed from a slow wheel, and less from a fast one",
    measurement="raise both wheels' commands slowly and log the wheels' own speeds (encoders)",
    apply=apply,
    needs="track",
    starts=tuple((width, fade) for fade in (0.01, 0.03, 0.08) for width in (0.005, 0.02)),
)
