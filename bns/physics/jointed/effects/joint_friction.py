"""Dry (Coulomb) friction in one joint: a tight screw, a worn bushing, dirt. The effect's name ends in the joint."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.catalogue_parts import PerJoint
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, joint: str, held_rad: float) -> Plant:
    """Friction in one joint, as the error at which its servo overcomes it."""
    return plant.with_joint("friction_rad", joint, held_rad)


EFFECT = PerJoint(
    Effect(
        name="joint-friction",
        stage="mechanics",
        parameters=(
            Parameter(
                *("held_rad", "rad", -0.05, 1.5, (0.0, 0.3), 0.0),
                "error that the servo needs to overcome the dry friction of the joint (its torque over the servo's stiffness), "
                "beyond that in the model",
            ),
        ),
        equation="torque' = torque - held * k * sign(speed) of one joint; at rest it stays there while |torque| < held * k",
        residuals="The joint stops short of its set points, on the side from which it came; the others fit.",
        lookalikes=("dry-friction", "weak-joint", "soft-joint"),
        sentence="{joint} has more dry friction than in the model, or less",
        measurement="switch the servos off, and compare the torque at which {joint} begins to turn with that of its neighbours",
        starts=((0.01,), (0.06,), (0.2,)),
        apply=apply,
    )
)
