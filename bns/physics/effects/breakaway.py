"""A wheel at rest starts only above one command, and one that turns stops only below a lower one: friction at rest is higher.

A wheel whose command jumps to the other direction is not held: it does not rest in between. With both thresholds alike:
`dead-band`.
"""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.dead_band import EFFECT as ALIKE
from bns.physics.signals import Wheels
from bns.physics.wheels.scans import broken_away


def apply(wheels: Wheels, threshold_m_s: float, stop_ratio: float) -> Wheels:
    """A wheel stands from a command below ``stop_ratio``·``threshold_m_s`` to one of ``threshold_m_s``, and at the beginning."""
    stop = stop_ratio * threshold_m_s
    return wheels.turning(
        broken_away(wheels.left_m_s, wheels.step_s, threshold_m_s, stop),
        broken_away(wheels.right_m_s, wheels.step_s, threshold_m_s, stop),
    )


EFFECT = Effect(
    name="breakaway",
    stage="wheel",
    parameters=(
        *ALIKE.parameters,
        Parameter(
            "stop_ratio",
            "1",
            0.0,
            1.0,
            (0.0, 1.0),
            1.0,
            "command below which a turning wheel stops, divided by that at which one at rest starts",
            jagged=True,
            reached=(0.0, 1.0),
        ),
    ),
    equation="w = u from |u| >= t on until |u| < r·t, else 0, for each wheel",
    residuals="The same slow command is driven after a fast one and not after a stop.",
    lookalikes=("dead-band", "stribeck", "backlash"),
    sentence="a wheel at rest starts only at a higher command than the one at which a turning wheel stops",
    sized="a wheel at rest starts at {threshold_m_s}, and one that turns stops at {stop_ratio} of that",
    measurement="lift the robot, raise one wheel's command slowly until it turns, lower it until it stops, and note both",
    apply=apply,
    needs="track",
    extends="dead-band",
    starts=tuple((round(0.003 * 1.25**i, 5), ratio) for i in range(16) for ratio in (0.3, 0.7)),
)
