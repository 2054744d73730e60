"""Gears have play: a wheel that reverses stands still until its motor has crossed the gap.

The position in the gap at the start of a trial is not logged. The gears are assumed to touch in the forward direction,
as they do after the robot last drove forward.
"""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels
from bns.physics.wheels.scans import played


def apply(wheels: Wheels, gap_m: float) -> Wheels:
    """Each wheel loses ``gap_m`` of its distance whenever it changes direction."""
    return wheels.turning(
        played(wheels.left_m_s, wheels.step_s, gap_m, gap_m),
        played(wheels.right_m_s, wheels.step_s, gap_m, gap_m),
    )


EFFECT = Effect(
    name="backlash",
    stage="wheel",
    parameters=(
        Parameter("gap_m", "m", 0.0, 0.5, (0.0, 0.05), 0.0, "distance that a wheel loses when it reverses", size_power=1.0),
    ),
    equation="g' = min(max(g + u·dt, 0), gap), distance driven = u·dt - (g' - g), for each wheel, g = gap at the start",
    residuals="After each reversal of a wheel a fixed distance is missing at any speed; trials without reversals fit.",
    lookalikes=("caster-swing", "command-delay", "dead-zone"),
    sentence="play in the gears stops a wheel briefly whenever it changes direction",
    sized="play in the gears stops a wheel for {gap_m} of its distance whenever it changes direction",
    measurement="hold the motor still, turn the wheel by hand, and measure the play at its rim",
    assumes="backlash: the gears are assumed to touch in the forward direction when a trial begins. If the robot drove backwards "
    "or was pushed before, the gap is estimated too small (`backlash-start`): let it drive forward a little before each trial.",
    apply=apply,
    needs="track",
    starts=tuple((gap,) for gap in (0.0005, 0.002, 0.005, 0.01, 0.02, 0.04)),
)
