"""Gears have play: a wheel that reverses stands still until its motor has crossed the gap.

Where in the gap a wheel stands when a trial begins cannot be known from outside: it is taken to touch forward, as after
a robot was last driven so.
"""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels
from bns.physics.wheels.scans import played


def apply(wheels: Wheels, gap_m: float) -> Wheels:
    """Each wheel loses ``gap_m`` of its way whenever it changes direction."""
    return wheels.turning(
        played(wheels.left_m_s, wheels.step_s, gap_m),
        played(wheels.right_m_s, wheels.step_s, gap_m),
    )


EFFECT = Effect(
    name="backlash",
    stage="wheel",
    parameters=(
        Parameter("gap_m", "m", 0.0, 0.5, (0.0, 0.05), 0.0, "way that a wheel loses when it reverses", size_power=1.0),
    ),
    equation="g' = min(max(g + u·dt, 0), gap), way driven = u·dt - (g' - g), for each wheel, g = gap at the start",
    residuals="After each reversal of a wheel a fixed way is missing, whatever the speed; without reversals all fits.",
    lookalikes=("caster-swing", "command-delay", "dead-zone"),
    sentence="a wheel stands still for a moment after it changes direction",
    measurement="hold the motor and turn the wheel by hand: it moves by the gap",
    apply=apply,
    needs="track",
    starts=tuple((gap,) for gap in (0.0005, 0.002, 0.005, 0.01, 0.02, 0.04)),
)
