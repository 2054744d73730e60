"""Dry (Coulomb) friction in all joints: gears, seals and bushings that hold a joint until its servo pulls harder.

As an error, not as a torque: large joints have strong servos and more friction. It is what MuJoCo calls ``frictionloss``.
"""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, held_rad: float) -> Plant:
    """Friction in every joint, as the error at which its servo overcomes it."""
    return replace(plant, friction_rad=plant.friction_rad + held_rad)


EFFECT = Effect(
    name="dry-friction",
    stage="mechanics",
    parameters=(
        Parameter(
            *("held_rad", "rad", -0.05, 0.4, (0.0, 0.1), 0.0),
            "error that a servo needs to overcome the dry friction of its joint (torque over the servo's stiffness), beyond the "
            "model's",
        ),
    ),
    equation="torque' = torque - held * k * sign(speed); a joint at rest stays there while |torque| < held * k",
    residuals="Joints stop short of their set points, on the side from which they came, and swing less.",
    lookalikes=("dead-band", "compliance", "servo-delay"),
    sentence="the joints have more dry friction than the model's, or less",
    measurement="switch the servos off, and pull at a link with a spring balance: at which torque does each joint begin to turn?",
    starts=((0.005,), (0.02,), (0.06,)),
    apply=apply,
)
