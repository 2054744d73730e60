"""A wheel needs time to reach its commanded speed."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.scans import first_order


def apply(wheels: Wheels, tau_s: float) -> Wheels:
    """First-order lag of each wheel, from rest."""

    def late(values: Array) -> Array:
        return first_order(values, wheels.step_s, tau_s)

    return wheels.following(late(wheels.left_m_s), late(wheels.right_m_s), late)


EFFECT = Effect(
    name="motor-lag",
    stage="wheel",
    parameters=(Parameter("tau_s", "s", 0.0, 5.0, (0.0, 1.0), 0.0, "time constant of the wheel's speed control"),),
    equation="dw/dt = (u - w)/tau for each wheel",
    residuals="The first command falls short by speed times tau, whatever its duration; later "
    "commands begin with a rest of the previous one. Short commands are affected most.",
    lookalikes=("command-delay", "acceleration-limit", "speed-gain"),
    sentence="the motors follow their commands with a lag",
    sized="the motors follow their commands with a lag of {tau_s}",
    measurement="log the wheels' own speeds (encoders) at a high rate while a command changes",
    apply=apply,
    needs="track",
)
