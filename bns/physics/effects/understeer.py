"""A fast robot turns less than its wheel speeds imply, because wheels skid and tyres scrub."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body


def apply(body: Body, loss_s_m: float) -> Body:
    """Turn rate times 1 - loss·|v|, never reversed."""
    kept = np.maximum(1.0 - loss_s_m * np.abs(body.forward_m_s), 0.0)
    return replace(body, yaw_rad_s=body.yaw_rad_s * kept)


EFFECT = Effect(
    name="understeer",
    stage="body",
    parameters=(
        Parameter(
            "loss_s_m", "s/m", -2.0, 2.0, (-0.4, 0.4), 0.0, "fraction of turn rate lost per m/s of speed (negative: oversteer)"
        ),
    ),
    equation="omega' = omega·max(1 - k·|v|, 0)",
    residuals="Turns on the spot fit; curves are too straight, and more so at higher speed.",
    lookalikes=("wheelbase", "turn-slip", "speed-limit"),
    sentence="the robot turns less (or more) the faster it drives",
    sized="the robot turns {loss_s_m:less|more|} the faster it drives",
    measurement="drive a circle of one commanded diameter at several speeds, and measure its diameter on the floor",
    apply=apply,
)
