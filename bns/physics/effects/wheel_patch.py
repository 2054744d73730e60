"""A round patch of floor that slows each wheel while the wheel itself is on it: the robot turns where one wheel enters first.

`floor-patch` slows the whole robot while its centre is there; that is this effect where the distance between the two slowed
points is 0.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.floor_patch import EFFECT as WHOLE
from bns.physics.effects.floor_patch import share_inside, starts_from
from bns.physics.signals import Body, Wheels


def apply(body: Body, x_m: float, y_m: float, radius_m: float, loss: float, apart_share: float) -> Body:
    """Each side's speed times 1 - ``loss`` while the point ``apart_share`` half wheelbases to that side is on the patch."""
    return slowed(body, (x_m, y_m), radius_m, (loss, loss), apart_share)


def slowed(body: Body, centre_m: tuple[float, float], radius_m: float, losses: tuple[float, float], apart_share: float) -> Body:
    """The same with a loss for the left side and one for the right."""
    if body.place is None:
        return body
    heading, half = body.place[..., 2], body.wheelbase_m / 2.0
    aside = apart_share * half * np.stack([-np.sin(heading), np.cos(heading)], axis=-1)  # to the left
    inside = [
        share_inside(
            body,
            body.place[..., :2] + side * aside,
            body.forward_m_s - side * apart_share * half * body.yaw_rad_s,
            centre_m,
            radius_m,
            loss,
        )
        for side, loss in zip((1.0, -1.0), losses, strict=True)
    ]
    left, right = (1.0 - loss * share for loss, share in zip(losses, inside, strict=True))
    left_m_s, right_m_s = left * (body.forward_m_s - half * body.yaw_rad_s), right * (body.forward_m_s + half * body.yaw_rad_s)
    return replace(
        body,
        forward_m_s=(left_m_s + right_m_s) / 2.0,
        yaw_rad_s=(right_m_s - left_m_s) / body.wheelbase_m,
        sideways_m_s=body.sideways_m_s * (left + right) / 2.0,
    )


def _starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    return tuple((*start, 1.0) for start in starts_from(wheels))


APART = Parameter(
    "apart_share",
    "1",
    0.0,
    2.0,
    (0.0, 1.5),
    0.0,
    "half the distance between the two points that are slowed, divided by half the wheelbase (1: the wheels)",
    resolution=0.02,
    jagged=True,
    reached=(0.0,),
)

EFFECT = Effect(
    name="wheel-patch",
    stage="body",
    parameters=(*WHOLE.parameters, APART),
    equation="l, r times 1 - k while the left, the right point is where (x - px)^2 + (y - py)^2 < p^2; the points are a·b/2 to "
    "either side",
    residuals="As with a patch of floor, and where the patch is entered at its side, the robot turns towards it.",
    lookalikes=("floor-patch", "tether-pull"),
    sentence="each wheel is slower on one patch of the floor",
    sized="each wheel is {loss:slower|faster} on one patch of the floor, {radius_m} in radius",
    measurement="inspect the floor there, or drive straight over its edge with one wheel outside",
    apply=apply,
    revision=2,
    needs="track",
    needs_place=True,
    starts_from=_starts_from,
    extends="floor-patch",
)
