"""The order in which effects act, from the command to the camera."""

from __future__ import annotations

OTHERS, DECOYS, FORMULAS = "others", "decoys", "formulas"
"""Places for effects that are not in the catalogue: those of users, decoys, formulas."""

ORDER = (
    "command-timeout",  # counts from changes of the command itself
    "command-quantisation",
    "command-truncation",
    "command-rate",
    "speed-gain",
    "reverse-gain",
    "wheel-mismatch",
    "battery-sag",
    "supply-sag",
    "warm-up",
    "dead-zone",
    "dead-zone-mismatch",
    "friction-warm-up",
    "stribeck",
    "dead-band",
    "breakaway",
    "speed-limit",
    "speed-limit-mismatch",
    "speed-scaling",
    "reversal-pause",
    OTHERS,
    "acceleration-limit",  # exact for commands, which are constant in a step: so before delay and lag
    "force-limit",
    "braking-limit",
    "velocity-ramp",
    "braking-ramp",
    "command-delay",
    "motor-lag",
    "inertia-lag",
    "lag-mismatch",
    "braking-lag",
    "gear-friction",
    "controller-overshoot",
    "sliding-contact",
    "heating",  # by the work that the wheels really do
    "wheel-diameters",
    "wheel-eccentricity",
    "backlash",
    "wheelbase",
    "turn-dead-zone",
    "turn-slip",
    "turn-slip-quadratic",
    "understeer",
    "side-slip",
    "caster-swing",
    "caster-drag",
    "floor-patch",
    "wheel-patch",
    "uneven-patch",
    "carpet-drift",
    "slope-load",
    "tether-load",
    DECOYS,
    FORMULAS,
    "yaw-bias",
    "floor-slope",
    "tether-pull",
    "clock-offset",
    "clock-drift",
    "marker-offset",
    "sensor-rotation",
    "tilted-camera",
    "lens-distortion",
    "camera-scale",
    "camera-rotation",
    "compass-deviation",
)
"""Stages come first (wheel, body, world, clock, measure); this is the order of effects that are put together by the machine."""


def place(name: str, after: str) -> float:
    """The place of an effect in the chain: its own in `ORDER`, or right after ``after``."""
    return float(ORDER.index(name)) if name in ORDER else ORDER.index(after) + 0.5
