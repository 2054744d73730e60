"""The order in which effects act, from the command to the camera."""

from __future__ import annotations

from collections.abc import Sequence

OTHERS, DECOYS, FORMULAS = "others", "decoys", "formulas"
"""Places for effects that are not in the catalogue: those of users, decoys, formulas."""

ORDER = (
    "command-timeout",  # counts from changes of the command itself
    "overload-trip",  # and so do these two
    "supply-trip",
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
    "start-delay",
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
    "scrub-friction",
    "controller-overshoot",
    "traction-limit",
    "sliding-contact",
    "heating",  # by the work that the wheels really do
    "wheel-diameters",
    "wheel-eccentricity",
    "backlash",
    "backlash-mismatch",
    "backlash-start",
    "wheelbase",
    "turn-asymmetry",
    "pivot-slip",
    "turn-dead-zone",
    "turn-slip",
    "turn-slip-quadratic",
    "understeer",
    "mass-offset",
    "side-slip",
    "caster-swing",
    "caster-trail",
    "caster-drag",
    "floor-patch",
    "wheel-patch",
    "uneven-patch",
    "floor-joints",
    "floor-tiles",
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
    "heading-delay",
    "marker-offset",
    "sensor-rotation",
    "tilted-camera",
    "lens-distortion",
    "affine-distortion",
    "camera-scale",
    "camera-rotation",
    "compass-deviation",
)
"""Stages come first (wheel, body, world, clock, measure); this is the order of effects that are put together by the machine."""


FRICTION = ("dead-zone", "dead-zone-mismatch", "friction-warm-up", "stribeck", "dead-band", "breakaway")
"""What a wheel loses at a steady speed, or stands still for. It acts before `RAMPS` or behind all of them.

The order shows: behind a ramp a wheel stands until the ramp has reached what friction takes, at a start and, twice as long, at
a reversal. A ramp of commands (a speed profile) has friction behind it; firmware that ramps what it has reduced has it before.
"""
RAMPS = ("acceleration-limit", "force-limit", "braking-limit", "velocity-ramp", "braking-ramp")


def place(name: str, after: str, friction_last: bool = False) -> float:
    """The place of an effect in the chain: its own in `ORDER`, or right after ``after``.

    ``friction_last``: friction acts behind ramps.
    """
    if friction_last and name in FRICTION:
        return ORDER.index(RAMPS[-1]) + (1 + FRICTION.index(name)) / (1 + len(FRICTION)) / 2
    return float(ORDER.index(name)) if name in ORDER else ORDER.index(after) + 0.5


def is_friction_last(names: Sequence[str]) -> bool | None:
    """Whether friction comes behind ramps among names in the order in which they act; None where one of the two is not there."""
    friction = next((at for at, name in enumerate(names) if name in FRICTION), None)
    ramp = next((at for at, name in enumerate(names) if name in RAMPS), None)
    return None if friction is None or ramp is None else friction > ramp
