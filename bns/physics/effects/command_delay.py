"""A command reaches the wheels a constant time after it was sent."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.scans import delayed


def apply(wheels: Wheels, delay_s: float) -> Wheels:
    """Each wheel's speed, ``delay_s`` later, averaged over each step: the distance driven is exact.

    Where tracks are followed steps are long, and what a lag did before varies within them.
    """
    varying = wheels.conditions.seen is not None

    def late(values: Array) -> Array:
        return delayed(values, wheels.step_s, delay_s, varying)

    return wheels.following(late(wheels.left_m_s), late(wheels.right_m_s), late)


EFFECT = Effect(
    name="command-delay",
    stage="wheel",
    parameters=(Parameter("delay_s", "s", 0.0, 5.0, (0.0, 1.0), 0.0, "time from sending a command to its effect"),),
    equation="u'(t) = u(t - delay), 0 before the first command",
    residuals="At the start of every command the wheels still follow the previous one: the error is "
    "proportional to the change of speed between commands, and the same for all commands that last longer than "
    "the delay.",
    lookalikes=("motor-lag", "acceleration-limit"),
    sentence="commands reach the motors after a delay",
    sized="commands reach the motors after a delay of {delay_s}",
    measurement="film an LED on the robot that lights when a command arrives, with the tracker's camera",
    apply=apply,
    needs="track",
)
