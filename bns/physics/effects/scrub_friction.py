"""Tyres or tracks that scrub over the floor brake turns, and end them sooner than the motors' lag alone would.

With the moment of inertia J, motors that push with D·(Omega - omega) towards a commanded turn rate Omega, and a torque T of dry
friction, it is J·omega' = D·(Omega - omega) - T·sign(omega): a lag of J/D towards a rate that lies c = T/D below Omega. From
omega the robot stands after J/D·ln(1 + omega/c). Straight motion has a lag of its own, as in `inertia-lag`, which it is
without friction. Without a lag it is `turn-dead-zone`.
"""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.friction import braked
from bns.physics.wheels.scans import first_order


def apply(wheels: Wheels, tau_s: float, turn_ratio: float, width_rad_s: float) -> Wheels:
    """First-order lag of the wheels' mean; of their difference ``turn_ratio`` times that, with dry friction. From rest."""

    def late(values: Array) -> Array:
        return first_order(values, wheels.step_s, tau_s)

    half_m_s = (wheels.right_m_s - wheels.left_m_s) / 2
    half_m_s = braked(half_m_s, wheels.step_s, tau_s * turn_ratio, width_rad_s * wheels.wheelbase_m / 2)
    mean_m_s = late((wheels.left_m_s + wheels.right_m_s) / 2)
    return wheels.following(mean_m_s - half_m_s, mean_m_s + half_m_s, late)


EFFECT = Effect(
    name="scrub-friction",
    stage="wheel",
    parameters=(
        Parameter("tau_s", "s", 0.0, 5.0, (0.0, 1.0), 0.0, "time constant of the forward motion"),
        Parameter(
            "turn_ratio", "1", 0.02, 20.0, (0.1, 5.0), 1.0, "time constant of turns on the spot, divided by that on lines"
        ),
        Parameter("width_rad_s", "rad/s", 0.0, 5.0, (0.0, 0.5), 0.0, "turn rate lost to friction"),
    ),
    equation="dm/dt = (mean of u - m)/tau for the wheels' mean m, dw/dt = (turn rate of u - w - c·sign(w))/(r·tau) for the turn "
    "rate w; friction up to c holds it at 0",
    residuals="Slow turns fall short by a larger fraction than fast ones; turns begin as a lag lets them, and end sooner.",
    lookalikes=("motor-lag", "inertia-lag", "turn-dead-zone", "gear-friction"),
    sentence="the motors follow their commands with a lag, and friction with the floor brakes turns and ends them sooner",
    sized="the motors follow their commands with a lag of {tau_s} on straight lines, which is {turn_ratio:longer|shorter} in "
    "turns; friction with the floor takes {width_rad_s} from every turn, and ends it sooner",
    measurement="log a gyroscope at a high rate while the robot turns on the spot and stops, at several speeds",
    apply=apply,
    needs="track",
    starts=tuple((tau_s, 1.0, friction) for tau_s in (0.05, 0.15, 0.4) for friction in (0.05, 0.2)),
    extends="motor-lag",
    contains=("inertia-lag",),
)
