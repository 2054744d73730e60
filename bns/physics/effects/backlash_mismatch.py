"""The gears of one side have more play than those of the other: a loose shaft, a worn gear.

Where both have the same: `backlash`, or `backlash-start`.
"""

from __future__ import annotations

from collections.abc import Mapping

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.backlash_start import EFFECT as ALIKE
from bns.physics.figures import figures
from bns.physics.signals import Wheels
from bns.physics.wheels.scans import played

_NOTABLE = 0.05
"""Less play than this share of the other side's is told as none."""


def apply(wheels: Wheels, gap_m: float, crossed_share: float, left_share: float) -> Wheels:
    """At each change of its direction the left wheel loses ``left_share``·``gap_m``, the right one the rest of 2·``gap_m``.

    ``crossed_share`` of each gap is crossed already when a trial begins.
    """
    left_m, right_m = gap_m * left_share, gap_m * (2.0 - left_share)
    return wheels.turning(
        played(wheels.left_m_s, wheels.step_s, left_m, crossed_share * left_m),
        played(wheels.right_m_s, wheels.step_s, right_m, crossed_share * right_m),
    )


def sized_by(values: Mapping[str, float]) -> str:
    """With the play of each side."""
    left = values["gap_m"] * values["left_share"]
    sides = {"left": 1e3 * left, "right": 1e3 * (2.0 * values["gap_m"] - left)}
    more, less = sorted(sides, key=sides.__getitem__, reverse=True)
    other = f"for {figures(sides[less])} mm" if sides[less] > _NOTABLE * sides[more] else "hardly"
    said = f"play in the gears stops the {more} wheel for {figures(sides[more])} mm of its way whenever it changes direction"
    return f"{said}, and the {less} one {other}"


EFFECT = Effect(
    name="backlash-mismatch",
    stage="wheel",
    parameters=(
        *ALIKE.parameters,
        Parameter(
            "left_share",
            "1",
            0.0,
            2.0,
            (0.0, 2.0),
            1.0,
            "play of the left gears, divided by the mean of both sides (0: only the right ones have play, 2: only the left ones)",
            reached=(0.0, 2.0),
        ),
    ),
    equation="as backlash-start, with the gap g·gap on the left and (2 - g)·gap on the right",
    residuals="After each reversal of one wheel the robot has turned by a fixed angle more or less, at any speed; trials without "
    "reversals fit.",
    lookalikes=("backlash", "backlash-start", "yaw-bias", "lag-mismatch"),
    sentence="play in the gears stops one wheel for longer than the other whenever it changes direction",
    sized_by=sized_by,
    measurement="hold each motor still, turn its wheel by hand, and measure the play at either rim",
    assumes="backlash-mismatch: the gears are assumed to lie at one place of their gaps whenever a trial begins. Let the robot "
    "drive forward a little before each trial, and they touch forwards.",
    apply=apply,
    needs="track",
    extends="backlash",
    contains=("backlash-start",),
)
