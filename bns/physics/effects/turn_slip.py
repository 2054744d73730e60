"""A turning robot drives slower than its wheel speeds imply."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body


def apply(body: Body, slip_s: float) -> Body:
    """Forward speed times 1 - slip·|omega|, never reversed."""
    kept = np.maximum(1.0 - slip_s * np.abs(body.yaw_rad_s), 0.0)
    return replace(body, forward_m_s=body.forward_m_s * kept)


EFFECT = Effect(
    name="turn-slip",
    stage="body",
    parameters=(Parameter("slip_s", "s/rad", 0.0, 1.0, (0.0, 0.4), 0.0, "fraction of speed lost per rad/s of turn rate"),),
    equation="v' = v·max(1 - k·|omega|, 0)",
    residuals="Arcs are too short, sharp ones most, left and right alike; straight commands and headings fit.",
    lookalikes=("speed-gain", "wheelbase", "side-slip"),
    sentence="turning costs forward speed",
    measurement="log the wheels' own speeds (encoders) in curves: they follow the commands although the robot is slower",
    apply=apply,
)
