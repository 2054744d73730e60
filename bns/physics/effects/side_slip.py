"""The robot slides outwards in a curve."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body


def apply(body: Body, slip_s: float) -> Body:
    """Sideways velocity slip·v·omega: to the right in a left turn, always outwards."""
    return replace(body, sideways_m_s=body.sideways_m_s + slip_s * body.forward_m_s * body.yaw_rad_s)


EFFECT = Effect(
    name="side-slip",
    stage="body",
    parameters=(
        Parameter("slip_s", "s", -2.0, 2.0, (-1.0, 1.0), 0.0, "sideways velocity per centripetal acceleration v·omega"),
    ),
    equation="s' = s + k·v·omega, s the velocity to the right",
    residuals="The path lies outside the commanded arc; the error grows with speed and turn rate. Headings fit.",
    lookalikes=("turn-slip", "marker-offset"),
    sentence="the robot slides outwards in curves",
    sized="the robot slides {slip_s:outwards|inwards|} in curves",
    measurement="drive the same circle slowly and fast, and compare its diameters and the robot's angle to its path",
    apply=apply,
)
