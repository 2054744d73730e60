"""The tracker's clock and the robot's clock differ by a constant time."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Stamps


def apply(stamps: Stamps, offset_s: float | Array) -> Stamps:
    """A pose stamped t was taken at t - ``offset_s``: one number for all, or one for each stamp."""
    return replace(stamps, t_s=stamps.t_s - offset_s)


EFFECT = Effect(
    name="clock-offset",
    stage="clock",
    parameters=(
        Parameter("offset_s", "s", -5.0, 5.0, (-1.0, 1.0), 0.0, "how late poses are time-stamped (negative: early)"),
    ),
    equation="pose'(t) = pose(t - offset)",
    residuals="The whole track is shifted along itself: the error is speed times offset, and zero at rest.",
    lookalikes=("command-delay", "motor-lag"),
    sentence="the tracker's clock and the clock of the commands differ by a constant time",
    sized="the tracker's clock is {offset_s:ahead of|behind} the clock of the commands",
    measurement="film an event that both clocks time-stamp (an LED switched by the computer that logs the commands)",
    beside={
        "command-delay": "A late command and a late clock look the same in a log: time-stamp an event that both clocks see."
    },
    or_of_robot="if the offset is positive, the robot answers later than by a single lag, as with a filter in the controller "
    "before that of the motor. An event that both clocks time-stamp tells which",
    apply=apply,
    needs="track",
    per_trial_allowed=True,
)
