"""A fast robot turns less than its wheels say: skidding wheels and scrubbing tyres give way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body


def apply(body: Body, loss_s_m: float) -> Body:
    """Turn rate times 1 - loss·|v|, never turned round."""
    kept = np.maximum(1.0 - loss_s_m * np.abs(body.forward_m_s), 0.0)
    return replace(body, yaw_rad_s=body.yaw_rad_s * kept)


EFFECT = Effect(
    name="understeer",
    stage="body",
    parameters=(
        Parameter(
            "loss_s_m", "s/m", -2.0, 2.0, (-0.4, 0.4), 0.0, "share of the turn rate lost per m/s (negative: oversteer)"
        ),
    ),
    equation="omega' = omega·max(1 - k·|v|, 0)",
    residuals="Turns on the spot fit; curves come out too straight, the more so the faster they are driven.",
    lookalikes=("wheelbase", "turn-slip", "speed-limit"),
    sentence="how far the robot turns depends on how fast it drives",
    apply=apply,
)
