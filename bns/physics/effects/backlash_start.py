"""Gears with play that do not touch in the forward direction when a trial begins: the robot drove backwards, or was pushed.

Where they do: `backlash`. Where they touch at another place in each trial, this is their mean.
"""

from __future__ import annotations

from collections.abc import Mapping

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.backlash import EFFECT as FORWARD
from bns.physics.figures import figures, mm
from bns.physics.signals import Wheels
from bns.physics.wheels.scans import played


def apply(wheels: Wheels, gap_m: float, crossed_share: float) -> Wheels:
    """As `backlash`, with ``crossed_share``·``gap_m`` of the gap crossed already when a trial begins."""
    begin_m = gap_m * crossed_share
    return wheels.turning(
        played(wheels.left_m_s, wheels.step_s, gap_m, begin_m), played(wheels.right_m_s, wheels.step_s, gap_m, begin_m)
    )


def sized_by(values: Mapping[str, float]) -> str:
    """With the way that is lost before a trial's first motion forwards."""
    first_mm = 1e3 * values["gap_m"] * (1.0 - values["crossed_share"])
    return (
        f"play in the gears stops a wheel for {mm(values['gap_m'])} of its way whenever it changes direction, and for "
        f"{figures(first_mm)} mm when a trial begins forwards"
    )


EFFECT = Effect(
    name="backlash-start",
    stage="wheel",
    parameters=(
        *FORWARD.parameters,
        Parameter(
            "crossed_share",
            "1",
            0.0,
            1.0,
            (0.0, 1.0),
            1.0,
            "fraction of the gap that is crossed when a trial begins (1: the gears touch forwards, 0: backwards)",
            reached=(0.0, 1.0),
        ),
    ),
    equation="as backlash, with g = c·gap at the start",
    residuals="As with backlash, and the first way forwards of each trial is short by a fixed distance, too.",
    lookalikes=("backlash", "command-delay", "dead-zone"),
    sentence="play in the gears stops a wheel whenever it changes direction, and when a trial begins",
    sized_by=sized_by,
    measurement="hold the motor still, turn the wheel by hand, and measure the play; drive forwards a little before trials",
    assumes="backlash-start: the gears are assumed to lie at one place of their gap whenever a trial begins. Let the robot drive "
    "forward a little before each trial, and `backlash` is enough.",
    apply=apply,
    needs="track",
    extends="backlash",
)
