"""The robot's controller changes its forward velocity and its turn rate by ramps, with steeper or flatter ones to slow down.

The velocity smoother of ROS's Kobuki has a ``decel_factor`` for this, that of Nav2 limits of their own. At 1: `velocity-ramp`.
"""

from __future__ import annotations

import math

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.braking import limited

_FORWARD_M_S2, _TURN_RAD_S2 = (0.1, 0.3, 1.0, 3.0), (0.5, 1.5, 5.0, 15.0)
"""Where a fit begins: what small and fast robots are set to."""


def _ramped(told: Array, step_s: Array, most: float, brake_ratio: float) -> Array:
    return limited(told, step_s, most, most * brake_ratio) if math.isfinite(most) else told


def apply(wheels: Wheels, forward_m_s2: float, turn_rad_s2: float, brake_ratio: float) -> Wheels:
    """Forward velocity and turn rate follow their commands with at most these, ``brake_ratio`` times that to slow down."""
    mean = _ramped((wheels.left_m_s + wheels.right_m_s) / 2, wheels.step_s, forward_m_s2, brake_ratio)
    turning = turn_rad_s2 * wheels.wheelbase_m / 2
    half = _ramped((wheels.right_m_s - wheels.left_m_s) / 2, wheels.step_s, turning, brake_ratio)
    return wheels.turning(mean - half, mean + half)


EFFECT = Effect(
    name="braking-ramp",
    stage="wheel",
    parameters=(
        Parameter("forward_m_s2", "m/s^2", 1e-3, math.inf, (0.02, 20.0), math.inf, "highest forward acceleration"),
        Parameter("turn_rad_s2", "rad/s^2", 1e-2, math.inf, (0.05, 500.0), math.inf, "highest acceleration of turning"),
        Parameter("brake_ratio", "1", 0.02, 50.0, (0.2, 5.0), 1.0, "highest decelerations, divided by these"),
    ),
    equation="|dv/dt| <= a while |v| rises, r·a while it falls, for v = (l + r)/2; |d(omega)/dt| <= c, r·c for the turn rate",
    residuals="As with ramps of velocity and turn rate, but a stop takes another way than a start from rest to the same speed.",
    lookalikes=("velocity-ramp", "braking-limit"),
    sentence="forward velocity and turn rate are changed by ramps, by others to slow down",
    sized="forward velocity and turn rate are changed by ramps, which are {brake_ratio:steeper|flatter} to slow down",
    measurement="read the limits of acceleration and deceleration in the settings of the drive or of the velocity smoother",
    apply=apply,
    needs="track",
    starts=tuple((forward, turn, 1.0) for forward in _FORWARD_M_S2 for turn in _TURN_RAD_S2),
    extends="velocity-ramp",
)
