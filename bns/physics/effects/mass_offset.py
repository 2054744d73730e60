"""The centre of mass lies ahead of the axle, or behind it, and motors that are not stiff give way to its inertia.

About the midpoint of the axle, a robot of mass m with its centre of mass d ahead obeys m·(dv/dt - d·omega²) = F and
(J + m·d²)·domega/dt + m·d·v·omega = T (R. Fierro and F. L. Lewis, Control of a nonholonomic mobile robot, Journal of Robotic
Systems 14(3), 1997). Wheels at a distance b with motors of the force k·(u - w) each, as of `inertia-lag`, then settle where the
forward speed is higher by c·omega² and the turn rate lower by 4·c·v·omega/b², with c = m·d/(2·k): the distance times the time
constant of straight lines. Motors with an integral controller give way for a moment only.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body

ROUNDS = 4
"""Rounds in which speed and turn rate settle: where a third of the turn rate is lost, it is right to a thousandth."""
SPIN = 3.0


def apply(body: Body, lead_m_s: float) -> Body:
    """Forward speed and turn rate where both have settled; at most `SPIN` times the turn rate, where the robot would spin."""
    turn = body.yaw_rad_s
    for _ in range(ROUNDS):
        forward = body.forward_m_s + lead_m_s * turn**2
        turn = body.yaw_rad_s / np.maximum(1.0 + 4.0 * lead_m_s * forward / body.wheelbase_m**2, 1.0 / SPIN)
    return replace(body, forward_m_s=body.forward_m_s + lead_m_s * turn**2, yaw_rad_s=turn)


EFFECT = Effect(
    name="mass-offset",
    stage="body",
    parameters=(
        Parameter(
            "lead_m_s",
            "m·s",
            -1.0,
            1.0,
            (-0.005, 0.005),
            0.0,
            "distance of the centre of mass ahead of the axle times the time constant with which the motors follow on straight "
            "lines (negative: behind the axle)",
            size_power=1.0,
        ),
    ),
    equation="v' = v + c·omega'^2, omega' = omega/(1 + 4·c·v'/b^2)",
    residuals="Curves are too wide when the robot drives forward and too narrow when it drives backward, or the reverse; turns "
    "on the spot fit, but drift to the heavy side.",
    lookalikes=("understeer", "marker-offset", "inertia-lag"),
    sentence="the robot's mass lies ahead of or behind its axle, and turns it less one way than the other",
    sized="the robot's mass lies {lead_m_s:ahead of|behind|} its axle: it turns {lead_m_s:less|more|} when it drives forward, "
    "and {lead_m_s:more|less|} backward",
    measurement="drive one circle forward and the same one backward, and measure both diameters; or find the centre of mass: "
    "balance the robot on an edge below it",
    apply=apply,
)
