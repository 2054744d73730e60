"""Commands take effect on the ticks of a controller's clock, not when they are sent.

The clock is assumed to start with the trial, as in a program that is started for each trial. If it runs freely, each
command is late by a different fraction of the period: a `command-delay` of half a period on average, plus scatter.
"""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.scans import sampled


def apply(wheels: Wheels, period_s: float) -> Wheels:
    """Each wheel keeps the speed commanded at the last multiple of ``period_s``."""
    if period_s == 0.0:
        return wheels

    def late(values: Array) -> Array:
        return sampled(values, wheels.step_s, period_s)

    return wheels.following(late(wheels.left_m_s), late(wheels.right_m_s), late)


EFFECT = Effect(
    name="command-rate",
    stage="wheel",
    parameters=(
        Parameter(
            "period_s",
            "s",
            0.0,
            5.0,
            (0.0, 1.5),
            0.0,
            "time between two updates of the command",
            resolution=1e-4,
            jagged=True,
        ),
    ),
    equation="u'(t) = u(period·floor(t/period))",
    residuals="Each command takes effect at the next tick of a clock: late by between zero and one period.",
    lookalikes=("command-delay", "motor-lag"),
    sentence="the robot updates its command only at fixed intervals",
    sized="the robot updates its command only every {period_s}",
    measurement="log on the robot the time at which each command takes effect",
    apply=apply,
    needs="track",
    # ticks late in a trial must fall into the right frame, so a period is found near these alone: makers choose round ones
    starts=tuple((period,) for period in (0.04, 0.05, 0.08, 0.1, 0.125, 0.2, 0.25, 0.3, 0.4, 0.5, 0.75, 1.0)),
)
