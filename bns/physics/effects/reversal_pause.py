"""A wheel stands for a while before it turns the other way: motor drivers protect their bridges so, and some firmware does."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels
from bns.physics.wheels.standing import paused


def apply(wheels: Wheels, pause_s: float) -> Wheels:
    """A wheel's new direction begins no sooner than ``pause_s`` after its old one ended; it stands until then."""
    return wheels.turning(
        paused(wheels.left_m_s, wheels.step_s, pause_s), paused(wheels.right_m_s, wheels.step_s, pause_s)
    )


EFFECT = Effect(
    name="reversal-pause",
    stage="wheel",
    parameters=(
        Parameter("pause_s", "s", 0.0, 5.0, (0.0, 1.0), 0.0, "time for which a wheel stands before it reverses", resolution=1e-3),
    ),
    equation="u' = 0 for a time T after u changed its sign, for each wheel",
    residuals="After a change of a wheel's direction a distance is missing that is proportional to its new speed; all else fits.",
    lookalikes=("backlash", "command-delay", "acceleration-limit"),
    sentence="a wheel stands for a moment whenever it reverses",
    sized="a wheel stands for {pause_s} whenever it reverses",
    measurement="lift the robot, reverse one wheel, log its encoder",
    apply=apply,
    needs="track",
)
