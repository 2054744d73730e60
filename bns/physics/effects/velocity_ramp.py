"""The robot's controller changes its forward velocity and its turn rate by ramps, each by itself.

So do the velocity smoothers and drive controllers of ROS, and most drives that take a forward velocity and a turn rate. A limit
of each wheel's own acceleration is `acceleration-limit`.
"""

from __future__ import annotations

import math

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels
from bns.physics.wheels.scans import rate_limited

_FORWARD_M_S2, _TURN_RAD_S2 = (0.1, 0.3, 1.0, 3.0), (0.5, 1.5, 5.0, 15.0)
"""Where a fit begins: what small and fast robots are set to."""


def apply(wheels: Wheels, forward_m_s2: float, turn_rad_s2: float) -> Wheels:
    """The wheels' mean follows its command with at most ``forward_m_s2``, the turn rate with ``turn_rad_s2``; from rest."""
    mean = rate_limited((wheels.left_m_s + wheels.right_m_s) / 2, wheels.step_s, forward_m_s2)
    half = rate_limited((wheels.right_m_s - wheels.left_m_s) / 2, wheels.step_s, turn_rad_s2 * wheels.wheelbase_m / 2)
    return wheels.turning(mean - half, mean + half)


EFFECT = Effect(
    name="velocity-ramp",
    stage="wheel",
    parameters=(
        Parameter("forward_m_s2", "m/s^2", 1e-3, math.inf, (0.02, 20.0), math.inf, "highest forward acceleration"),
        Parameter("turn_rad_s2", "rad/s^2", 1e-2, math.inf, (0.05, 500.0), math.inf, "highest acceleration of turning"),
    ),
    equation="|dv/dt| <= a for v = (l + r)/2, |d(omega)/dt| <= c for omega = (r - l)/b",
    residuals="Starts and stops fall short as with an acceleration limit, but a turn is as late while the robot speeds up as it "
    "is at a constant speed.",
    lookalikes=("acceleration-limit", "force-limit", "motor-lag"),
    sentence="forward velocity and turn rate are changed by ramps, each by itself",
    measurement="read the limits of acceleration in the settings of the drive or of the velocity smoother, or log the wheels' "
    "own speeds (encoders) while a command changes",
    apply=apply,
    needs="track",
    starts=tuple((forward, turn) for forward in _FORWARD_M_S2 for turn in _TURN_RAD_S2),
)
