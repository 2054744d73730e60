"""A wheel slows down with another lag than it speeds up.

A driver that lets the motor run down freely, a gear that holds itself, an integrator that is cleared by a command to stop: the
equation has one time constant while the speed's magnitude rises, another while it falls. At a ratio of 1: `motor-lag`.
"""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.braking import lagging


def apply(wheels: Wheels, tau_s: float, brake_ratio: float) -> Wheels:
    """First-order lag of each wheel from rest, of ``brake_ratio`` times ``tau_s`` while it becomes slower."""

    def late(values: Array) -> Array:
        return lagging(values, wheels.step_s, tau_s, tau_s * brake_ratio)

    return wheels.following(late(wheels.left_m_s), late(wheels.right_m_s), late)


EFFECT = Effect(
    name="braking-lag",
    stage="wheel",
    parameters=(
        Parameter("tau_s", "s", 0.0, 5.0, (0.0, 1.0), 0.0, "time constant of a wheel that speeds up"),
        Parameter("brake_ratio", "1", 0.02, 50.0, (0.2, 5.0), 1.0, "time constant of a wheel that slows down, divided by that"),
    ),
    equation="dw/dt = (u - w)/t for each wheel, t = tau while |w| rises, r·tau while it falls",
    residuals="As with a lag of the motors, but a stop takes another way than a start from rest to the same speed.",
    lookalikes=("motor-lag", "gear-friction", "backlash"),
    sentence="the wheels slow down with another lag than they speed up",
    sized="the wheels follow their commands with a lag of {tau_s}, which is {brake_ratio:longer|shorter} while they slow down",
    measurement="log the wheels' own speeds (encoders) at a high rate, from rest to a speed and from that speed to rest",
    apply=apply,
    needs="track",
    extends="motor-lag",
)
