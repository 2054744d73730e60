"""A caster drags until it has swung round behind its pivot.

The pivot is assumed to lie half a wheelbase ahead of the axle; this distance changes only the result of turns on the spot.
The direction of the caster at the start of a trial is not logged: it is assumed to be that after driving forward.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import CREEP_M_S, Body
from bns.physics.wheels.scans import swung


def apply(body: Body, loss: float, trail_m: float) -> Body:
    """All velocities times 1 - ``loss`` while the caster points backwards; it swings round within about ``trail_m``."""
    left, right = body.left_m_s, body.right_m_s
    ahead, side = (left + right) / 2.0, (right - left) / 2.0  # of a pivot half a wheelbase before the axle
    speed = np.hypot(ahead, side)
    step_s = np.diff(body.session_s, axis=1, prepend=body.session_s[:, :1]) if body.step_s is None else body.step_s
    way = np.where(speed > CREEP_M_S, speed * step_s, 0.0)
    return body.scaled(1.0 - loss * swung(np.arctan2(side, ahead), way, trail_m))


EFFECT = Effect(
    name="caster-swing",
    stage="body",
    parameters=(
        Parameter("loss", "1", 0.0, 0.95, (0.0, 0.8), 0.0, "fraction of speed lost while the caster points backwards"),
        Parameter("trail_m", "m", 5e-4, 1.0, (1e-3, 0.3), 0.02, "distance in which it swings round", size_power=1.0),
    ),
    equation="d(psi)/ds = (beta - psi)/trail, beta = atan2(omega·b/2, v), all velocities times 1 - k·(1 - cos(beta - psi))/2",
    residuals="After each change between forward, backward and turning on the spot, the robot is too slow for a "
    "few centimetres; long commands of one kind fit.",
    lookalikes=("caster-trail", "backlash", "motor-lag", "acceleration-limit"),
    sentence="the caster slows the robot until it has swung round",
    measurement="film the caster after a reversal, or replace it with a sliding button and repeat some trials",
    apply=apply,
    revision=2,
    needs="track",
    starts=tuple((loss, trail) for loss in (0.05, 0.3) for trail in (0.005, 0.02, 0.06)),
)
