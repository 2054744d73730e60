"""The battery discharges, and the wheels become slower."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels


def apply(wheels: Wheels, rate_per_s: float, per_volt: float) -> Wheels:
    """Both speeds fall by the fraction ``rate_per_s`` per second of the session, or by ``per_volt`` per volt."""
    kept: Array = 1.0 - rate_per_s * wheels.session_s
    if wheels.conditions.battery_drop_v is not None:
        kept = kept - per_volt * wheels.conditions.battery_drop_v
    return replace(wheels, left_m_s=wheels.left_m_s * kept, right_m_s=wheels.right_m_s * kept)


EFFECT = Effect(
    name="battery-sag",
    stage="wheel",
    parameters=(
        Parameter(
            "rate_per_s",
            "1/s",
            -0.05,
            0.05,
            (-2e-3, 2e-3),
            0.0,
            "fraction of speed lost per second of the session",
            instead_of="battery_v",
        ),
        Parameter(
            "per_volt",
            "1/V",
            -2.0,
            2.0,
            (-0.5, 0.5),
            0.0,
            "fraction of speed lost per volt below the first value logged",
            column="battery_v",
        ),
    ),
    equation="u' = u·(1 - rate·session - per_volt·(V0 - V)) for each wheel",
    residuals="Distances and turns shrink by one fraction, which grows from trial to trial.",
    lookalikes=("speed-gain",),
    sentence="the robot becomes slower (or faster) in the course of the session, as when its battery discharges",
    sized="the robot becomes {rate_per_s:slower|faster|} in the course of the session (a discharging battery makes it slower)",
    measurement="log the battery's voltage (column battery_v)",
    explained_by=("session_s", "battery_v"),
    caveat="No session_s or battery_v was logged: the trials are assumed to follow one another without pauses.",
    apply=apply,
)
