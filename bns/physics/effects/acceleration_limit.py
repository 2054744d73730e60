"""The motor, or its controller's speed profile, limits the acceleration of a wheel.

In a model it belongs before delay and lag: it is exact for commands, which are constant within a step, and accurate
to one step for speeds that change within a step.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels
from bns.physics.wheels.scans import rate_limited


def apply(wheels: Wheels, max_m_s2: float) -> Wheels:
    """Each wheel's speed follows its command with at most ``max_m_s2``, from rest."""
    return replace(
        wheels,
        left_m_s=rate_limited(wheels.left_m_s, wheels.step_s, max_m_s2),
        right_m_s=rate_limited(wheels.right_m_s, wheels.step_s, max_m_s2),
    )


EFFECT = Effect(
    name="acceleration-limit",
    stage="wheel",
    parameters=(
        Parameter("max_m_s2", "m/s^2", 1e-3, math.inf, (0.02, 50.0), math.inf, "highest acceleration of a wheel"),
    ),
    equation="|dw/dt| <= a for each wheel",
    residuals="A start from rest falls short by u^2/(2·a): fast commands lose more than in proportion. Steps of "
    "speed become ramps.",
    lookalikes=("motor-lag", "command-delay"),
    sentence="the acceleration of the wheels is limited",
    sized="no wheel changes its speed faster than by {max_m_s2}",
    measurement="log the wheels' own speeds (encoders) at a high rate while a command changes",
    apply=apply,
    needs="track",
    # apart from what is plausible: a limit above 20 m/s^2 is reached from 20, and what a log of a vehicle ends in depends on them
    starts=tuple((float(most),) for most in np.geomspace(0.02, 20.0, 30)),
)
