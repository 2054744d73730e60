"""Friction takes a constant amount from the turn rate: tracks or tyres that scrub over the floor, casters that resist.

Where each wheel loses a constant amount: `dead-zone`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body


def apply(body: Body, width_rad_s: float) -> Body:
    """The turn rate reduced towards zero by ``width_rad_s``, and not beyond zero."""
    turn = body.yaw_rad_s
    return replace(body, yaw_rad_s=np.sign(turn) * np.maximum(np.abs(turn) - width_rad_s, 0.0))


EFFECT = Effect(
    name="turn-dead-zone",
    stage="body",
    parameters=(Parameter("width_rad_s", "rad/s", 0.0, 5.0, (0.0, 0.5), 0.0, "turn rate lost to friction"),),
    equation="omega' = sign(omega)·max(|omega| - c, 0)",
    residuals="Slow turns fall short by a larger fraction than fast ones; slight curves are driven straight.",
    lookalikes=("wheelbase", "dead-zone", "understeer", "motor-lag"),
    sentence="turning loses a constant part of its rate to friction",
    sized="turning loses {width_rad_s} of its rate to friction",
    measurement="turn on the spot ever faster, and note the command at which the robot begins to turn",
    apply=apply,
)
