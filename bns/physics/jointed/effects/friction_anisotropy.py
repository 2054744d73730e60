"""Friction along a link differs from friction across it: scales, wheels, rubber bands."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, across: float) -> Plant:
    """Friction across each link, as a multiple; along it unchanged."""
    return replace(plant, friction_across=plant.friction_across * across)


EFFECT = Effect(
    name="friction-anisotropy",
    stage="mechanics",
    parameters=(
        Parameter("across", "1", 0.1, 8.0, (0.3, 4.0), 1.0, "friction across a link, as a multiple of that along it"),
    ),
    equation="mu_across' = across * mu",
    residuals="Sideways waves move the robot along its body, where the model predicts no net motion.",
    lookalikes=("floor-friction",),
    sentence="the links slide more easily in one direction than in the other",
    measurement="switch the robot off, lay it straight, and drag it along and across with a spring balance",
    apply=apply,
)
