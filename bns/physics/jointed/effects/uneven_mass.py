"""One end of the body is heavier than the other: batteries, boards, a cable."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, gradient: float) -> Plant:
    """Masses that rise linearly from the first link to the last, by this fraction on either side of the middle."""
    return replace(plant, mass=plant.mass * (1.0 + gradient * np.linspace(-1.0, 1.0, len(plant.mass))))


EFFECT = Effect(
    name="uneven-mass",
    stage="mechanics",
    parameters=(
        Parameter(
            "gradient", "1", -0.95, 0.95, (-0.8, 0.8), 0.0, "fraction by which the last link is heavier and the first lighter"
        ),
    ),
    equation="m' = m * (1 + gradient * s), s from -1 at the first link to 1 at the last",
    residuals="One end moves less than predicted and the other more: heavy links tend to stay in place.",
    lookalikes=("tether-drag",),
    sentence="the mass is distributed over the body differently from the model",
    measurement="weigh the robot at both ends on two scales",
    apply=apply,
)
