"""The motor, or its controller's speed profile, limits the acceleration of a wheel.

In a model it belongs before delay and lag: it is exact for commands, which are constant within a step, and accurate
to one step for speeds that change within a step.

A controller's speed profile limits each wheel by itself. Where the motors' force is the limit, the body joins the wheels: on a
straight line each wheel moves half of the mass m, in a turn on the spot a part of the moment of inertia J. With the force f of a
wheel, the limits are 2·f/m and f·b^2/(2·J), whose ratio is m·b^2/(4·J): 1 for a profile, 2 for a disc as wide as the wheelbase b,
more for a load near the centre.
"""

from __future__ import annotations

import math
from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels
from bns.physics.wheels.scans import limited_together, rate_limited


def apply(wheels: Wheels, max_m_s2: float, turn_ratio: float = 1.0) -> Wheels:
    """Each wheel's speed follows its command with at most ``max_m_s2``, from rest; with ``turn_ratio`` times that in turns."""
    if turn_ratio == 1.0 or not math.isfinite(max_m_s2):
        return replace(
            wheels,
            left_m_s=rate_limited(wheels.left_m_s, wheels.step_s, max_m_s2),
            right_m_s=rate_limited(wheels.right_m_s, wheels.step_s, max_m_s2),
        )
    return wheels.turning(
        *limited_together(wheels.left_m_s, wheels.right_m_s, wheels.step_s, max_m_s2, turn_ratio * max_m_s2)
    )


EFFECT = Effect(
    name="acceleration-limit",
    stage="wheel",
    parameters=(
        Parameter("max_m_s2", "m/s^2", 1e-3, math.inf, (0.02, 20.0), math.inf, "highest acceleration of a wheel"),
        Parameter(
            "turn_ratio",
            "1",
            0.05,
            50.0,
            (0.2, 8.0),
            1.0,
            "highest acceleration of a wheel in turns, divided by that on lines",
            optional=True,
        ),
    ),
    equation="|dw/dt| <= a where both wheels change in one direction, r·a in opposite ones, 2·a·r/(1 + r) if the other wheel "
    "keeps its speed",
    residuals="A start from rest falls short by u^2/(2·a): fast commands lose more than in proportion. Steps of "
    "speed become ramps. Where the motors' force is the limit, turns lose less than straight lines.",
    lookalikes=("motor-lag", "command-delay"),
    sentence="the acceleration of the wheels is limited",
    measurement="log the wheels' own speeds (encoders) at a high rate while a command changes, ahead and on the spot",
    apply=apply,
    needs="track",
)
