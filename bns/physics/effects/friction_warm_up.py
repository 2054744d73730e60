"""Friction takes speed from each wheel, most from a cold robot: grease and bearings that warm up over a session, or run in.

Where it stays the same: `dead-zone`.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.dead_zone import EFFECT as STEADY
from bns.physics.effects.dead_zone import shrunk
from bns.physics.signals import Wheels


def apply(wheels: Wheels, width_m_s: float, cold_m_s: float, time_s: float) -> Wheels:
    """Each wheel loses ``width_m_s`` + ``cold_m_s``·exp(-t/``time_s``), never beyond 0; t since the session began."""
    width = np.maximum(width_m_s + cold_m_s * np.exp(-np.maximum(wheels.session_s, 0.0) / time_s), 0.0)
    return wheels.turning(shrunk(wheels.left_m_s, width), shrunk(wheels.right_m_s, width))


EFFECT = Effect(
    name="friction-warm-up",
    stage="wheel",
    parameters=(
        *STEADY.parameters,
        Parameter(
            "cold_m_s",
            "m/s",
            -1.0,
            1.0,
            (-0.05, 0.1),
            0.0,
            "speed that each wheel loses in addition when the session begins (negative: loses less)",
            size_power=1.0,
        ),
        Parameter(
            "time_s", "s", 1.0, 1e4, (10.0, 3600.0), 300.0, "time constant with which the additional loss decays", resolution=0.1
        ),
    ),
    equation="w = sign(u)·max(|u| - d - c·exp(-session/T), 0) for each wheel",
    residuals="Slow commands fall short, in the first trials of a session more than later.",
    lookalikes=("dead-zone", "battery-sag", "heating"),
    sentence="friction takes more speed from the wheels of a cold robot than later in the session",
    sized="friction takes {width_m_s} of its speed from every wheel, {cold_m_s:more|less} when the session begins",
    measurement="lift the robot while it is cold, raise one wheel's command slowly from zero, and note the command at which the "
    "wheel begins to turn; again after half an hour of driving",
    explained_by=("session_s",),
    caveat="No session_s was logged: the trials are assumed to follow one another without pauses.",
    apply=apply,
    needs="track",
    extends="dead-zone",
)
