"""A wheel changes its speed no faster than the motor, or its controller's profile, allows.

In a model it belongs before delay and lag: it is exact for commands, which are constant in a step, and good
to one step for speeds that change inside a step.
"""

from __future__ import annotations

import math
from dataclasses import replace

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
        Parameter("max_m_s2", "m/s^2", 1e-3, math.inf, (0.02, 20.0), math.inf, "highest change of a wheel's speed"),
    ),
    equation="|dw/dt| <= a for each wheel",
    residuals="A start from rest falls short by half the squared speed over a: fast commands lose "
    "more than in proportion, and steps of speed are ramps.",
    lookalikes=("motor-lag", "command-delay"),
    sentence="the wheels' speed can change only so fast",
    measurement="log the wheels' own speeds (encoders) at a high rate while a command changes",
    apply=apply,
    needs="track",
)
