"""The motors differ: one wheel follows its commands later than the other, and every change of speed turns the robot.

So does a worn gearbox, a motor of another make, or a controller that was tuned for one wheel. At 1 both lag alike: `motor-lag`.
"""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.scans import first_order


def apply(wheels: Wheels, tau_s: float, ratio: float) -> Wheels:
    """First-order lags from rest, left by 2·tau/(1 + ratio), right by ``ratio`` times that: their mean is ``tau_s``."""
    left_s = 2.0 * tau_s / (1.0 + ratio)

    def late(values: Array, by_s: float = tau_s) -> Array:
        return first_order(values, wheels.step_s, by_s)

    return wheels.following(late(wheels.left_m_s, left_s), late(wheels.right_m_s, left_s * ratio), late)


EFFECT = Effect(
    name="lag-mismatch",
    stage="wheel",
    parameters=(
        Parameter("tau_s", "s", 0.0, 5.0, (0.0, 1.0), 0.0, "time constant of the wheels' speed control, mean of both"),
        Parameter("ratio", "1", 0.02, 50.0, (0.2, 5.0), 1.0, "time constant of the right wheel, divided by that of the left"),
    ),
    equation="dw/dt = (u - w)/t for each wheel, t = 2·tau/(1 + r) on the left, 2·tau·r/(1 + r) on the right",
    residuals="As with a lag of the motors; and at every change of speed the robot turns, back again where it stops.",
    lookalikes=("motor-lag", "wheel-mismatch"),
    sentence="the motors follow their commands with a lag that differs between the wheels",
    sized="the motors follow their commands with a lag of {tau_s} on average, which is {ratio:longer|shorter} on the "
    "right than on the left",
    measurement="log the wheels' own speeds (encoders) at a high rate while both are given the same step of speed",
    apply=apply,
    needs="track",
    extends="motor-lag",
)
