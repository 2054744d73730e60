"""One servo is weak or gives no torque: a worn gear, a loose horn, a broken wire. The effect's name ends in the joint."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.catalogue_parts import PerJoint
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, joint: str, strength: float) -> Plant:
    """Stiffness, torque limit and the servo's own damping of one joint, as a fraction."""
    for values in ("stiffness", "torque", "damping"):
        plant = plant.with_joint(values, joint, strength)
    return plant


EFFECT = PerJoint(
    Effect(
        name="weak-joint",
        stage="mechanics",
        parameters=(
            Parameter(
                "strength", "1", 0.0, 1.0, (0.0, 1.0), 1.0, "servo strength over that in the model (0: none)", reached=(0.0,)
            ),
        ),
        equation="torque' = strength * torque of one joint",
        residuals="The distance between markers and the direction of motion differ in the cycles that use this joint.",
        lookalikes=("joint-zero", "compliance", "soft-joint", "joint-friction"),
        sentence="the servo of {joint} is weak or gives no torque",
        measurement="switch the robot on, lift it, and press against {joint} by hand: a sound servo resists",
        starts=((0.8,), (0.4,), (0.0,)),
        apply=apply,
    )
)
