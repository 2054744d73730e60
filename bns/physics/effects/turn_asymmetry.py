"""The robot turns further to one side than to the other: a guard or a cable that rubs, a brush, a wheel that stands askew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body


def apply(body: Body, share: float) -> Body:
    """Turn rate times 1 + ``share`` in left turns, times 1 - ``share`` in right ones."""
    return replace(body, yaw_rad_s=body.yaw_rad_s + share * np.abs(body.yaw_rad_s))


EFFECT = Effect(
    name="turn-asymmetry",
    stage="body",
    parameters=(
        Parameter(
            "share", "1", -0.9, 0.9, (-0.3, 0.3), 0.0, "fraction that left turns are larger by, and right turns smaller by"
        ),
    ),
    equation="omega' = omega + k·|omega|",
    residuals="Left turns are too large by one fraction, right turns too small, or the reverse, at any speed; straight commands "
    "fit. With a wheelbase that is wrong by as much, turns to one side alone are wrong.",
    lookalikes=("yaw-bias", "wheelbase", "wheel-mismatch"),
    sentence="the robot turns further to one side than to the other",
    sized="left turns are {share:larger|smaller}, and right turns {share:smaller|larger|} by as much",
    measurement="compare ten turns on the spot to the left with ten to the right, each with a mark on the floor",
    apply=apply,
)
