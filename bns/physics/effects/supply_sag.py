"""The supply voltage drops under load: each wheel slows the other down, since their motors share a battery.

With viscous friction the current of a motor rises in proportion to its speed w. So the voltage falls to 1 - k·(|w_l| + |w_r|) of
what it is without load, and both speeds with it. Where the voltage falls over a session: `battery-sag`.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels


def apply(wheels: Wheels, loss_s_m: float) -> Wheels:
    """Both speeds over 1 + ``loss_s_m`` times the sum of their magnitudes."""
    kept = 1.0 / (1.0 + loss_s_m * (np.abs(wheels.left_m_s) + np.abs(wheels.right_m_s)))
    return wheels.turning(wheels.left_m_s * kept, wheels.right_m_s * kept)


EFFECT = Effect(
    name="supply-sag",
    stage="wheel",
    parameters=(
        Parameter(
            "loss_s_m",
            "s/m",
            0.0,
            10.0,
            (0.0, 1.5),
            0.0,
            "fraction of voltage lost per m/s of both wheels' speeds together",
            size_power=-1.0,
        ),
    ),
    equation="l' = s·l, r' = s·r, s = 1/(1 + k·(|l| + |r|))",
    residuals="Each wheel is slower, the faster the other one turns, to whichever side; slow commands fit.",
    lookalikes=("speed-gain", "battery-sag", "turn-slip-quadratic"),
    sentence="the supply voltage drops when both motors are under load",
    measurement="lift the robot, count the turns of one wheel at a constant command while the other stands, and again while that "
    "one turns fast; or log the supply voltage",
    apply=apply,
)
