"""The tracker's clock and the robot's clock do not run at the same rate."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Stamps


def apply(stamps: Stamps, rate: float) -> Stamps:
    """A pose stamped t, counted from the trial's first row, was taken at t·(1 - ``rate``)."""
    return replace(stamps, t_s=stamps.t_s * (1.0 - rate))


EFFECT = Effect(
    name="clock-drift",
    stage="clock",
    parameters=(
        Parameter(
            "rate", "1", -0.2, 0.2, (-0.02, 0.02), 0.0, "seconds that the tracker's clock gains per second since the trial began"
        ),
    ),
    equation="pose'(t) = pose(t - rate·t)",
    residuals="The track leads or lags behind the commands by a time that grows during the trial; changes of speed show it.",
    lookalikes=("clock-offset", "speed-gain"),
    sentence="the tracker's clock runs faster or slower than the clock of the commands",
    sized="the tracker's clock runs {rate:faster|slower} than the clock of the commands",
    measurement="compare how both clocks stamp two events that are minutes apart (an LED switched by the "
    "computer that logs the commands)",
    apply=apply,
    needs="track",
)
