"""Turns on the spot fall short, and bends do not: tyres or tracks that scrub where the inner wheel runs backwards.

How much they scrub follows how far the inner wheel turns against the outer one: wholly on the spot, not at all where it stands.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body


def apply(body: Body, loss: float) -> Body:
    """Turn rate times 1 - ``loss``·c, with c the speed of the inner wheel against the outer one, as a share of that one's."""
    ahead, aside = np.abs(body.forward_m_s), np.abs(body.yaw_rad_s) * body.wheelbase_m / 2.0
    against = np.maximum(aside - ahead, 0.0) / np.maximum(aside + ahead, 1e-12)
    return replace(body, yaw_rad_s=body.yaw_rad_s * (1.0 - loss * against))


EFFECT = Effect(
    name="pivot-slip",
    stage="body",
    parameters=(
        Parameter("loss", "1", -0.9, 0.95, (-0.3, 0.6), 0.0, "fraction of the turn rate lost on the spot (negative: gained)"),
    ),
    equation="omega' = omega·(1 - k·max(0, -inner/outer)), with the speeds of the inner and the outer wheel",
    residuals="Turns on the spot are too small by one fraction at any speed; bends in which both wheels run the same way fit.",
    lookalikes=("wheelbase", "understeer", "turn-dead-zone"),
    sentence="turns on the spot fall short, and bends do not",
    sized="turns on the spot are {loss:smaller|larger}, and bends fit",
    measurement="turn ten times on the spot, then drive ten circles with both wheels forwards, each to a mark on the floor",
    apply=apply,
)
