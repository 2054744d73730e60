"""A caster's hinge resists while the caster swings, and its wheel presses sideways against the robot.

The caster's wheel rolls where it points; that turns it. The hinge's torque is carried by a force across the wheel, a trail
behind the hinge: it slows or pushes the robot and turns it, until the caster trails again. A motor that gives way loses speed
in proportion to that force. The direction of the caster at the start of a trial is not logged: the force is the mean over all
directions, which differ less and less while the robot drives.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body
from bns.physics.wheels.casters import swivelled

_DIRECTIONS = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
"""Of the caster at the start of a trial."""


def apply(body: Body, friction_m_s: float, damping_m: float, trail_m: float, pivot_m: float) -> Body:
    """What the side force adds to the forward and the yaw velocity; ``pivot_m`` ahead of the axle, negative behind it."""
    step_s = np.diff(body.session_s, axis=1, prepend=body.session_s[:, :1]) if body.step_s is None else body.step_s
    if friction_m_s == 0.0 and damping_m == 0.0:
        return body
    pushed, turned = swivelled(
        body.forward_m_s, body.yaw_rad_s, step_s, _DIRECTIONS, friction_m_s, damping_m, trail_m, pivot_m
    )
    half = body.wheelbase_m / 2.0
    return body.with_added("forward_m_s", pushed).with_added("yaw_rad_s", turned / half**2)


EFFECT = Effect(
    name="caster-drag",
    stage="body",
    parameters=(
        Parameter(
            "friction_m_s",
            "m/s",
            0.0,
            1.0,
            (0.0, 0.05),
            0.0,
            "speed lost to the hinge's dry friction",
            size_power=1.0,
            reached=(0.0,),
        ),
        Parameter(
            "damping_m",
            "m",
            0.0,
            1.0,
            (0.0, 0.05),
            0.0,
            "speed lost per rad/s at which the caster swings",
            size_power=1.0,
            reached=(0.0,),
        ),
        Parameter("trail_m", "m", 5e-4, 1.0, (1e-3, 0.1), 0.01, "from the hinge to the caster's wheel", size_power=1.0),
        Parameter("pivot_m", "m", -2.0, 2.0, (-0.2, 0.2), -0.0442, "from the axle forward to the hinge", size_power=1.0),
    ),
    equation="d(psi)/dt = s = (omega·p·cos(psi) - v·sin(psi))/trail - omega; q = f·s/(|s| + 0.1 rad/s) + k·s; "
    "v' = v + q·sin(psi), omega' = omega + q·(trail - p·cos(psi))·4/b^2; mean over eight directions psi at the start",
    residuals="After each change between forward, backward and turning, the robot is pushed aside and slowed for some trails "
    "of the caster, by nearly the same speed whether it is fast or slow; long commands of one kind fit.",
    lookalikes=("caster-swing", "backlash", "motor-lag"),
    sentence="the caster's hinge resists while it swings round, and its wheel pushes the robot sideways",
    measurement="pull the caster round with a spring balance, or replace it with a sliding button and repeat some trials",
    apply=apply,
    revision=2,
    needs="track",
    starts=tuple((0.004, 0.002, trail, pivot) for trail in (0.005, 0.012, 0.03) for pivot in (-0.0442, 0.0442)),
)
