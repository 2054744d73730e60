"""Where one wheel would be too fast, the controller slows both in proportion: the robot keeps its curve.

So do drives that take a forward velocity and a turn rate. Where each wheel is limited by itself: `speed-limit`.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels


def apply(wheels: Wheels, max_m_s: float) -> Wheels:
    """Both wheels times the largest share, at most 1, with which neither is faster than ``max_m_s``."""
    faster = np.maximum(np.abs(wheels.left_m_s), np.abs(wheels.right_m_s))
    share = max_m_s / np.maximum(faster, max_m_s) if math.isfinite(max_m_s) else 1.0
    return replace(wheels, left_m_s=wheels.left_m_s * share, right_m_s=wheels.right_m_s * share)


EFFECT = Effect(
    name="speed-scaling",
    stage="wheel",
    parameters=(Parameter("max_m_s", "m/s", 1e-3, math.inf, (0.02, 5.0), math.inf, "highest speed of the faster wheel"),),
    equation="l' = s·l, r' = s·r, s = min(1, limit/max(|l|, |r|))",
    residuals="Fast commands fall short, slow ones fit; fast curves are driven more slowly, with the same radius.",
    lookalikes=("speed-limit", "turn-slip"),
    sentence="both wheels are slowed in proportion where one of them would exceed a limit",
    sized="both wheels are slowed in proportion where one of them would exceed {max_m_s}",
    measurement="command a fast curve and log the wheels' own speeds (encoders)",
    apply=apply,
)
