"""The wheels' speed controllers are weak against the robot's mass and inertia: turns lag otherwise than straight lines.

A proportional controller's force k·(u - w) moves half of the mass m on a straight line, in a turn on the spot a part of the
moment of inertia J: with the wheelbase b the time constants are m/(2·k) and 2·J/(k·b^2). Their ratio 4·J/(m·b^2) is 0.5 for a
disc as wide as the wheelbase, and less for a load near the centre. At 1 each wheel lags by itself: `motor-lag`.
"""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.scans import first_order


def apply(wheels: Wheels, tau_s: float, turn_ratio: float) -> Wheels:
    """First-order lag of the wheels' mean by ``tau_s``, and of their difference by ``turn_ratio`` times that, from rest."""

    def late(values: Array, by_s: float = tau_s) -> Array:
        return first_order(values, wheels.step_s, by_s)

    mean = late((wheels.left_m_s + wheels.right_m_s) / 2)
    half = late((wheels.right_m_s - wheels.left_m_s) / 2, tau_s * turn_ratio)
    return wheels.following(mean - half, mean + half, late)


EFFECT = Effect(
    name="inertia-lag",
    stage="wheel",
    parameters=(
        Parameter("tau_s", "s", 0.0, 5.0, (0.0, 1.0), 0.0, "time constant of the forward motion"),
        Parameter(
            "turn_ratio", "1", 0.02, 20.0, (0.1, 5.0), 1.0, "time constant of turns on the spot, divided by that on lines"
        ),
    ),
    equation="dm/dt = (mean of u - m)/tau for the wheels' mean m, dd/dt = (difference of u - d)/(r·tau) for their difference d",
    residuals="As with a lag of the motors, but turns lose another part of their commands than straight lines, for they move the "
    "robot's inertia instead of its mass.",
    lookalikes=("motor-lag", "force-limit", "wheelbase"),
    sentence="the motors follow their commands with a lag, in turns with another than on straight lines",
    sized="the motors follow their commands with a lag of {tau_s} on straight lines, which is "
    "{turn_ratio:longer|shorter} in turns",
    measurement="log the wheels' own speeds (encoders) at a high rate while a command changes, ahead and on the spot; and "
    "again with a load in the robot's middle",
    apply=apply,
    needs="track",
    extends="motor-lag",
)
