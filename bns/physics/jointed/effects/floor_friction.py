"""The floor is smoother or rougher than the model's.

What is driven slowly by strong servos hardly shows it: friction on all sides alike cancels. What shows is how far links slip.
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
    residuals="Cycles that press links sideways go farther or less far; still postures fit.",
    lookalikes=("friction-anisotropy", "torque-limit", "compliance"),
    sentence="the floor is not as slippery as assumed",
    measurement="drag the robot, switched off, with a spring balance: pull over weight is the friction",
    apply=apply,
)
