"""Parallel joints of the floor, evenly spaced, at each of which a wheel loses way: planks, rows of tiles, seams of mats.

What a wheel loses it loses over a piece of its way about the joint: a wheel of 2 cm radius stands on both edges of a gap of 5 mm
for 1.5 cm, and one that is held there for a moment loses it in less.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.figures import mm
from bns.physics.signals import Body, Wheels
from bns.physics.wheels.joints import Joints, crossed, rows_of_joints

_NOWHERE_M = 100.0
"""Joints so far apart, none of them near: a robot crosses none. Where nothing stands out, a fit begins there, and ends there."""


def apply(body: Body, spacing_m: float, across_rad: float, at_m: float, loss_m: float, over_m: float) -> Body:
    """Each wheel's way is shorter by ``loss_m`` wherever it crosses a line, over ``over_m`` across it."""
    return losing(body, ((Joints(across_rad, spacing_m, at_m, over_m), loss_m),))


def losing(body: Body, rows: tuple[tuple[Joints, float], ...]) -> Body:
    """Each wheel's way shorter by its row's loss (m) wherever it crosses a joint of that row; never backwards."""
    if body.place is None or body.step_s is None:
        return body  # first round of a simulation: nobody knows yet where the robot goes
    half = body.wheelbase_m / 2.0
    ways = []
    for side in (1.0, -1.0):
        speed = body.forward_m_s - side * half * body.yaw_rad_s
        lost = np.zeros_like(speed)
        for joints, loss in rows:
            lost = lost + loss * crossed(body.place, body.step_s, side * half, speed, joints)
        with np.errstate(divide="ignore", invalid="ignore"):
            slower = np.where(body.step_s > 0.0, lost / body.step_s, 0.0)
        ways.append(np.sign(speed) * np.maximum(np.abs(speed) - slower, 0.0))
    left, right = ways
    return replace(body, forward_m_s=(left + right) / 2.0, yaw_rad_s=(right - left) / body.wheelbase_m)


def sized_by(values: Mapping[str, float]) -> str:
    """What a wheel loses, or gains, at each joint."""
    return f"{lost_by(values)} at each of the lines on the floor that lie {values['spacing_m']:.3g} m apart"


def lost_by(values: Mapping[str, float]) -> str:
    """How much of its way a wheel loses at one of the first row."""
    return f"a wheel {'loses' if values['loss_m'] >= 0 else 'gains'} {mm(abs(values['loss_m']))} of its way"


def _starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    return tuple((row.spacing_m, row.across_rad, row.at_m, loss, row.over_m) for row, loss in rows_of_joints(wheels))


EFFECT = Effect(
    name="floor-joints",
    stage="body",
    parameters=(
        Parameter(
            "spacing_m",
            "m",
            0.02,
            _NOWHERE_M,
            (0.05, 2.0),
            _NOWHERE_M,
            "distance between neighbouring joints",
            resolution=5e-4,
            jagged=True,
        ),
        Parameter(
            "across_rad",
            "rad",
            -np.pi,
            np.pi,
            (-np.pi / 2.0, np.pi / 2.0),
            0.0,
            "direction across the joints, from the x axis to the left",
            resolution=2e-3,
            jagged=True,
        ),
        Parameter(
            "at_m",
            "m",
            -1e3,
            1e3,
            (-1.0, 1.0),
            _NOWHERE_M / 2.0,
            "where one of them is, from the origin in that direction",
            resolution=1e-3,
            jagged=True,
        ),
        Parameter(
            "loss_m", "m", -0.1, 0.1, (-0.02, 0.02), 0.0, "way that a wheel loses at each (negative: gains)", resolution=2e-5
        ),
        Parameter(
            "over_m",
            "m",
            1e-3,
            0.2,
            (2e-3, 0.05),
            0.01,
            "how far a wheel drives, straight across the joint, while it loses that",
            resolution=1e-3,
            jagged=True,
            reached=(1e-3,),
        ),
    ),
    equation="at each joint, where x·cos a + y·sin a = at + n·s for a whole n, a wheel's way is shorter by d, over w about it",
    residuals="Each wheel loses the same way wherever it crosses one of several parallel lines on the floor, at any speed.",
    lookalikes=("speed-gain", "wheelbase", "floor-patch"),
    sentence="wheels lose way at evenly spaced lines on the floor",
    sized_by=sized_by,
    measurement="measure the distance between joints of the floor and where they lie, or lay one sheet over them and drive again",
    apply=apply,
    needs="track",
    needs_place=True,
    starts_from=_starts_from,
)
