"""The distance between the wheels' contact points differs from the nominal wheelbase."""

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
            "effective divided by nominal wheelbase (soft tyres: above 1)",
        ),
    ),
    equation="b' = e·b, so that omega = (r - l)/(e·b)",
    residuals="Every turn is too small or too large by the same fraction, left and right alike; straight commands fit.",
    lookalikes=("turn-slip", "wheel-mismatch"),
    sentence="the effective wheelbase differs from that of the model",
    sized="the effective wheelbase is {factor:longer|shorter} than that of the model",
    measurement="measure the distance between the wheels' tracks, or compare ten turns on the spot with a mark on the floor",
    apply=apply,
)
