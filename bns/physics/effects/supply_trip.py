"""Both motors are off for a while after a large change of their commands: the supply breaks down, or one protection serves both.

The current of both adds up. A supply that cannot give it lets the controller restart, or a driver with a lockout for low voltage
waits. For a protection of each motor by itself: `overload-trip`.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect
from bns.physics.effects.overload_trip import EFFECT as OF_ONE
from bns.physics.effects.overload_trip import changes_and_missing, starts_of
from bns.physics.signals import Wheels
from bns.physics.wheels.standing import tripped


def apply(wheels: Wheels, step_m_s: float, off_s: float) -> Wheels:
    """Both speeds are 0 for ``off_s`` after the commands change by more than ``step_m_s``, both changes added up."""
    if not math.isfinite(step_m_s):
        return wheels
    return wheels.turning(*tripped(wheels.left_m_s, wheels.right_m_s, wheels.step_s, step_m_s, off_s, True))


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """Limits and times with which wheels come nearest to where the tracker saw them; () without changes."""
    by, speed, missing = changes_and_missing(wheels)
    return starts_of(np.concatenate([by.sum(axis=0)] * 2), speed.ravel(), missing.ravel())


EFFECT = Effect(
    name="supply-trip",
    stage="wheel",
    parameters=(
        replace(OF_ONE.parameters[0], text="change of both commands, added up, above which both motors are switched off"),
        replace(OF_ONE.parameters[1], text="time for which they are off"),
    ),
    equation="u' = 0 for a time T after |du_l| + |du_r| > s, else u, for both wheels",
    residuals="After large changes of the commands distances of both wheels are missing that are proportional to their new "
    "speeds; after small ones none are.",
    lookalikes=("overload-trip", "reversal-pause", "acceleration-limit"),
    sentence="both motors are switched off for a while after a large change of their commands, as where the supply breaks down",
    sized="both motors are switched off for {off_s} after changes of their commands by more than {step_m_s} in all, as where the "
    "supply breaks down",
    measurement="log the supply's voltage at 100 Hz or faster while the robot reverses at full speed; repeat with a "
    "stronger supply",
    apply=apply,
    needs="track",
    starts_from=starts_from,
)
