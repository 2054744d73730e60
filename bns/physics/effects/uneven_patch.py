"""A round patch of floor that slows one wheel more than the other: a worn tyre, or a lighter side, slips there first.

Where both lose the same: `wheel-patch`, `floor-patch`.
"""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.floor_patch import EFFECT as WHOLE
from bns.physics.effects.floor_patch import starts_from
from bns.physics.effects.wheel_patch import APART, slowed
from bns.physics.signals import Body, Wheels

_ALL = 0.99
"""No wheel loses more than this share of its speed: one that stands never leaves the patch."""


def apply(body: Body, x_m: float, y_m: float, radius_m: float, loss: float, apart_share: float, left_share: float) -> Body:
    """As `wheel-patch`, with a loss of ``left_share``·``loss`` on the left and (2 - ``left_share``)·``loss`` on the right."""
    losses = min(loss * left_share, _ALL), min(loss * (2.0 - left_share), _ALL)
    return slowed(body, (x_m, y_m), radius_m, losses, apart_share)


def _starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    return tuple((*start, 1.0, share) for start in starts_from(wheels) for share in (0.0, 2.0))


EFFECT = Effect(
    name="uneven-patch",
    stage="body",
    parameters=(
        *WHOLE.parameters,
        APART,
        Parameter(
            "left_share",
            "1",
            0.0,
            2.0,
            (0.0, 2.0),
            1.0,
            "loss on the left, divided by the mean of both sides (0: only the right wheel loses, 2: only the left)",
            reached=(0.0, 2.0),
        ),
    ),
    equation="l times 1 - g·k, r times 1 - (2 - g)·k while the left, the right point is where (x - px)^2 + (y - py)^2 < p^2; "
    "the points are a·b/2 to either side",
    residuals="On one patch of the floor the robot turns to the same side, wherever it enters; elsewhere trials fit.",
    lookalikes=("wheel-patch", "floor-patch", "wheel-mismatch"),
    sentence="one wheel loses more speed than the other on one patch of the floor",
    sized="one patch of the floor, {radius_m} in radius, slows {left_share:the left|the right|side} wheel more",
    measurement="drive straight over the patch in both directions: the robot turns to the same side of its own",
    apply=apply,
    needs="track",
    needs_place=True,
    starts_from=_starts_from,
    extends="floor-patch",
    contains=("wheel-patch",),
)
