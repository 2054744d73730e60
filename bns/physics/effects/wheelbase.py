"""The wheels touch the floor nearer together or farther apart than the drawing says."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Wheels


def apply(wheels: Wheels, factor: float) -> Wheels:
    """Wheelbase times ``factor``."""
    return replace(wheels, wheelbase_m=wheels.wheelbase_m * factor)


EFFECT = Effect(
    name="wheelbase",
    stage="wheel",
    parameters=(
        Parameter(
            "factor",
            "1",
            0.2,
            5.0,
            (0.7, 2.2),  # skid-steered robots turn as if their wheels stood up to twice as far apart
            1.0,
            "effective over nominal distance of the wheels; soft tyres lie above 1",
        ),
    ),
    equation="b' = e·b, so that omega = (r - l)/(e·b)",
    residuals="Every turn is too small or too large by the same share, left and right alike; straight commands fit.",
    lookalikes=("turn-slip", "wheel-mismatch"),
    sentence="the wheels stand closer together or further apart than the model says",
    measurement="measure the distance between the wheels' tracks, or count turns on the spot against a mark on the floor",
    apply=apply,
)
