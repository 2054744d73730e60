"""Dry friction in motors and gears brakes the wheels, and ends a motion: a slow wheel stops sooner than it starts.

A motor with the torque constant k and the resistance R turns a wheel against the friction torque T and the inertia J that it has
to move. With the voltage V it obeys J·w' = k·(V - k·w)/R - T·sign(w): a lag of the time constant tau = J·R/k^2 towards a speed
that lies f = T·R/k^2 below V/k. While the wheel coasts to rest, friction pulls it towards -f, and it stands after
tau·ln(1 + w/f). A controller that only multiplies the error of the speed does the same. Firmware that adds a voltage to make up
for friction adds it in the direction of the command, so not while the wheel coasts: of f a part ``loss`` (0: none, f: all) is
missing at a steady command. J is that of both wheels of one body, as in `inertia-lag`, which it is without friction.
"""

from __future__ import annotations

from collections.abc import Mapping

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.friction import braked_together
from bns.physics.wheels.scans import first_order

_NOTABLE_LOSS = 0.05
"""Of the friction, as a fraction: a smaller loss is not said. Chosen by hand."""


def apply(wheels: Wheels, tau_s: float, turn_ratio: float, friction_m_s: float, loss_m_s: float) -> Wheels:
    """The wheels' lag with dry friction, from rest."""

    def late(values: Array) -> Array:
        return first_order(values, wheels.step_s, tau_s)  # where friction has stopped the wheels, these say so

    values = tau_s, turn_ratio, friction_m_s, loss_m_s
    left_m_s, right_m_s = braked_together(wheels.left_m_s, wheels.right_m_s, wheels.step_s, *values)
    return wheels.following(left_m_s, right_m_s, late)


def sized_by(values: Mapping[str, float]) -> str:
    """With what is missing at a steady command, where that is a notable part of the friction."""
    lag_ms, friction_mm_s, loss_mm_s = (1e3 * values[name] for name in ("tau_s", "friction_m_s", "loss_m_s"))
    said = (
        f"the motors follow their commands with a lag of {lag_ms:.3g} ms on straight lines, and friction in the gears, which "
        f"takes {friction_mm_s:.3g} mm/s from a wheel that coasts, ends a motion sooner"
    )
    return said if loss_mm_s < _NOTABLE_LOSS * friction_mm_s else f"{said}; at a steady command {loss_mm_s:.3g} mm/s are missing"


EFFECT = Effect(
    name="gear-friction",
    stage="wheel",
    parameters=(
        Parameter("tau_s", "s", 0.0, 5.0, (0.0, 1.0), 0.0, "time constant of the forward motion without friction"),
        Parameter(
            "turn_ratio", "1", 0.02, 20.0, (0.1, 5.0), 1.0, "time constant of turns on the spot, divided by that on lines"
        ),
        Parameter(
            "friction_m_s", "m/s", 0.0, 5.0, (0.0, 0.2), 0.0, "speed that friction takes while the wheel coasts", size_power=1.0
        ),
        Parameter(
            "loss_m_s",
            "m/s",
            0.0,
            1.0,
            (0.0, 0.1),
            0.0,
            "speed that is missing at a steady command, where nothing makes up for friction",
            size_power=1.0,
            reached=(0.0,),
        ),
    ),
    equation="tau·dm/dt = mean of p - m, r·tau·dd/dt = difference of p - d for the wheels' mean m and their difference d, "
    "with p = u + (f - l)·sign(u) - f·sign(w) of each; friction up to f holds a wheel at rest",
    residuals="After a stop the robot comes to rest sooner than a lag would let it; it starts as a lag lets it. Slow motions end "
    "the most abruptly.",
    lookalikes=("motor-lag", "inertia-lag", "dead-zone", "acceleration-limit"),
    sentence="friction in the gears ends a motion sooner than the motors alone would",
    sized_by=sized_by,
    measurement="log the wheels' own speeds (encoders) fast, from a command to stop until they stand; at several speeds",
    apply=apply,
    needs="track",
    starts=tuple((tau_s, 1.0, friction, 0.0) for tau_s in (0.05, 0.15, 0.4) for friction in (0.02, 0.1)),
    extends="motor-lag",
    contains=("inertia-lag",),
)
