"""The tracker's headings are older (or newer) than the positions beside them, as where a filter or a second sensor gives them.

A compass or a gyroscope beside a position fix, or a filter that smooths headings more than positions. The positions are on time;
where both are late by the same, that is `clock-offset`.
"""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Stamps


def apply(stamps: Stamps, delay_s: float) -> Stamps:
    """The heading of a pose is the one that the robot had ``delay_s`` before it was at the position."""
    return replace(stamps, heading_late_s=stamps.heading_late_s + delay_s)


EFFECT = Effect(
    name="heading-delay",
    stage="clock",
    parameters=(
        Parameter("delay_s", "s", -2.0, 2.0, (-0.5, 0.5), 0.0, "how much older than its position a pose's heading is"),
    ),
    equation="theta'(t) = theta(t - d), x'(t) = x(t), y'(t) = y(t)",
    residuals="In curves the robot seems to move to one side of its heading, by an angle that grows with the turn rate; and it "
    "seems to turn on for a moment after each turn.",
    lookalikes=("side-slip", "clock-offset", "camera-rotation"),
    sentence="the tracker's headings and its positions are not measured at the same time",
    sized="the tracker's headings are {delay_s:older|newer} than its positions",
    measurement="turn the robot by hand on a pivot, and compare when the position of a marker off the pivot and the heading stop",
    apply=apply,
    needs="track",
)
