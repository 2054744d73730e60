"""One wheel's speed is limited more than the other's, or alone: a weak motor, an amplifier at its limit, a tight gear.

Where both have the same limit: `speed-limit`.
"""

from __future__ import annotations

import math

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.speed_limit import EFFECT as ALIKE
from bns.physics.signals import Wheels


def apply(wheels: Wheels, max_m_s: float, left_spare: float) -> Wheels:
    """The slower wheel's speed is clipped to ±``max_m_s``, the other's to that over 1 - |``left_spare``|."""
    spares = max(left_spare, 0.0), max(-left_spare, 0.0)
    left, right = (max_m_s / (1.0 - spare) if spare < 1.0 else math.inf for spare in spares)
    return wheels.turning(np.clip(wheels.left_m_s, -left, left), np.clip(wheels.right_m_s, -right, right))


EFFECT = Effect(
    name="speed-limit-mismatch",
    stage="wheel",
    parameters=(
        *ALIKE.parameters,
        Parameter(
            "left_spare",
            "1",
            -1.0,
            1.0,
            (-1.0, 1.0),
            0.0,
            "how much of the left wheel's limit is above the right's (1: the left has none; negative: the other way round)",
            reached=(-1.0, 1.0),
        ),
    ),
    equation="w = min(max(u, -limit), limit), with limit/(1 - g) in the place of limit on the left if g > 0, "
    "limit/(1 + g) on the right if g < 0",
    residuals="Fast straight commands become curves to one side; slow ones fit.",
    lookalikes=("speed-limit", "wheel-mismatch"),
    sentence="the speed of one wheel is limited more than the other's",
    sized="{left_spare:the right|the left|side} wheel runs no faster than {max_m_s}, the other one may run faster",
    measurement="command full speed and log the wheels' own speeds (encoders)",
    apply=apply,
    extends="speed-limit",
)
