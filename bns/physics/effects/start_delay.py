"""A wheel at rest starts late: holding brakes must open, a driver wakes up, a controller must overcome friction first."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels
from bns.physics.wheels.standing import started_late


def apply(wheels: Wheels, wait_s: float) -> Wheels:
    """A wheel at rest begins to turn ``wait_s`` after its command has left 0; before a trial begins, it is at rest, too.

    A wheel that is told to reverse does not stand in between: `reversal-pause`.
    """
    return wheels.turning(
        started_late(wheels.left_m_s, wheels.step_s, wait_s), started_late(wheels.right_m_s, wheels.step_s, wait_s)
    )


EFFECT = Effect(
    name="start-delay",
    stage="wheel",
    parameters=(
        Parameter("wait_s", "s", 0.0, 5.0, (0.0, 1.0), 0.0, "how long a wheel at rest waits before it turns", resolution=1e-3),
    ),
    equation="u' = 0 for a time T after u was 0, for each wheel",
    residuals="After each stop a distance is missing that is proportional to the speed that follows; all else fits.",
    lookalikes=("command-delay", "motor-lag", "breakaway"),
    sentence="a wheel at rest starts late",
    sized="a wheel at rest starts {wait_s} late",
    measurement="lift the robot, start one wheel from rest, and compare the time of its first encoder pulse with the command's",
    apply=apply,
    needs="track",
)
