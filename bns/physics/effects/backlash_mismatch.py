"""The gears of one side have more play than those of the other: a loose shaft, a worn gear.

Where both have the same: `backlash`.
"""

from __future__ import annotations

from collections.abc import Mapping

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.backlash import EFFECT as ALIKE
from bns.physics.signals import Wheels
from bns.physics.wheels.scans import played

_NOTABLE = 0.05
"""Less play than this share of the other side's is told as none."""


def apply(wheels: Wheels, gap_m: float, left_share: float) -> Wheels:
    """At each change of its direction the left wheel loses ``left_share``·``gap_m``, the right one the rest of 2·``gap_m``."""
    left_m, right_m = gap_m * left_share, gap_m * (2.0 - left_share)
    return wheels.turning(
        played(wheels.left_m_s, wheels.step_s, left_m, left_m), played(wheels.right_m_s, wheels.step_s, right_m, right_m)
    )


def sized_by(values: Mapping[str, float]) -> str:
    """With the play of each side."""
    left = values["gap_m"] * values["left_share"]
    sides = {"left": 1e3 * left, "right": 1e3 * (2.0 * values["gap_m"] - left)}
    more, less = sorted(sides, key=sides.__getitem__, reverse=True)
    other = f"for {sides[less]:.2g} mm" if sides[less] > _NOTABLE * sides[more] else "hardly"
    said = f"play in the gears stops the {more} wheel for {sides[more]:.2g} mm of its way whenever it changes direction"
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
    equation="as backlash, with the gap g·gap on the left and (2 - g)·gap on the right",
    residuals="After each reversal of one wheel the robot has turned by a fixed angle more or less, at any speed; trials without "
    "reversals fit.",
    lookalikes=("backlash", "yaw-bias", "lag-mismatch"),
    sentence="play in the gears stops one wheel for longer than the other whenever it changes direction",
    sized_by=sized_by,
    measurement="hold each motor still, turn its wheel by hand, and measure the play at either rim",
    assumes="backlash-mismatch: the gears are assumed to touch in the forward direction when a trial begins. If the robot drove "
    "backwards or was pushed before, the gaps are estimated too small: let it drive forward a little before each trial.",
    apply=apply,
    needs="track",
    extends="backlash",
)
