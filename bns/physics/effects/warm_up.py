"""The robot is slow at the beginning of every trial: cold grease, a controller that ramps its speed up, a battery under load."""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels


def apply(wheels: Wheels, loss: float, time_s: float) -> Wheels:
    """Both speeds times 1 - ``loss``·exp(-t/``time_s``), t since the trial began."""
    kept = 1.0 - loss * np.exp(-wheels.trial_s / time_s)
    return wheels.turning(wheels.left_m_s * kept, wheels.right_m_s * kept)


EFFECT = Effect(
    name="warm-up",
    stage="wheel",
    parameters=(
        Parameter(
            "loss", "1", -1.0, 1.0, (-0.9, 0.9), 0.0, "fraction of speed lost at the start of a trial (negative: gained)"
        ),
        Parameter(  # longer than every trial, it would be a gain
            *("time_s", "s", 0.1, 600.0, (0.3, 120.0), 3.0, "time constant with which the loss decays"),
            resolution=0.01,
            trial_share=1.0,
        ),
    ),
    equation="u' = u·(1 - k·exp(-t/T)) for each wheel, t since the trial began",
    residuals="All motion is too slow early in a trial and right later, in every trial again.",
    lookalikes=("motor-lag", "acceleration-limit", "heating"),
    sentence="the robot is slow at the beginning of every trial",
    sized="the robot is {loss:slower|faster} at the beginning of every trial",
    measurement="run the wheels for a minute before a trial begins, and compare",
    apply=apply,
    needs="track",
    starts=tuple((loss, time) for time in (0.7, 2.0, 5.0, 15.0) for loss in (0.03, 0.2, -0.03)),
)
