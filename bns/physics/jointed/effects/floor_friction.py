"""The floor is smoother or rougher than the model's.

A body moved slowly by strong servos hardly shows it: friction that is equal on all sides cancels. The slip of links shows it.
"""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, factor: float) -> Plant:
    """Friction in both directions, as a multiple."""
    return replace(plant, friction_along=plant.friction_along * factor, friction_across=plant.friction_across * factor)


EFFECT = Effect(
    name="floor-friction",
    stage="mechanics",
    parameters=(
        Parameter("factor", "1", 0.1, 5.0, (0.4, 2.5), 1.0, "friction of the floor, as a multiple of the model's"),
    ),
    equation="mu' = factor * mu",
    residuals="Cycles that push links sideways move the robot farther, or less far; postures at rest fit.",
    lookalikes=("friction-anisotropy", "torque-limit", "compliance"),
    sentence="the friction of the floor differs from the model's",
    sized="the friction of the floor is {factor:higher|lower} than the model's",
    measurement="switch the robot off and drag it with a spring balance: pull divided by weight is the coefficient of friction",
    apply=apply,
)
