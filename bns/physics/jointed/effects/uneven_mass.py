"""The body's weight lies farther towards one of its ends: batteries, boards, a straightened cable."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, gradient: float) -> Plant:
    """Masses that rise evenly from the first link to the last, by this share on either side of the middle."""
    return replace(plant, mass=plant.mass * (1.0 + gradient * np.linspace(-1.0, 1.0, len(plant.mass))))


EFFECT = Effect(
    name="uneven-mass",
    stage="mechanics",
    parameters=(
        Parameter(
            "gradient", "1", -0.95, 0.95, (-0.8, 0.8), 0.0, "share by which the last link is heavier, the first lighter"
        ),
    ),
    equation="m' = m * (1 + gradient * s), s from -1 at the first link to 1 at the last",
    residuals="One end moves less than foreseen and the other more: heavy links stay where they are.",
    lookalikes=("tether-drag",),
    sentence="the weight is not spread over the body as assumed",
    measurement="weigh the robot at both ends on two scales",
    apply=apply,
)
