"""A turning robot drives slower than its wheel speeds imply; the loss grows with the square of the turn rate.

The sideways slip in a curve, proportional to v·omega, is `side-slip`.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body


def apply(body: Body, slip_s2: float) -> Body:
    """Forward speed times 1 - slip·omega², never reversed."""
    return body.with_added("forward_m_s", -body.forward_m_s * np.minimum(slip_s2 * body.yaw_rad_s**2, 1.0))


EFFECT = Effect(
    name="turn-slip-quadratic",
    stage="body",
    parameters=(
        Parameter(
            "slip_s2", "s^2/rad^2", 0.0, 1.0, (0.0, 0.4), 0.0, "fraction of speed lost per (rad/s)^2 of turn rate"
        ),
    ),
    equation="v' = v·max(1 - k·omega^2, 0)",
    residuals="Sharp arcs are far too short, wide ones nearly right, left and right alike; headings fit.",
    lookalikes=("turn-slip", "side-slip"),
    sentence="turning costs forward speed, in proportion to the square of the turn rate",
    measurement="log the wheels' own speeds (encoders) in curves: they follow the commands although the robot is slower",
    beside={
        "turn-slip": "The loss grows differently with turn rate: drive arcs at one speed and two turn rates, one twice the other."
    },
    apply=apply,
)
