"""One servo is weak, or silent: a worn gear, a loose horn, a broken wire. Which one is part of the effect's name."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.catalogue_parts import PerJoint
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, joint: str, strength: float) -> Plant:
    """Stiffness and torque limit of one joint, as a share."""
    return plant.with_joint("stiffness", joint, strength).with_joint("torque", joint, strength)


EFFECT = PerJoint(
    Effect(
        name="weak-joint",
        stage="mechanics",
        parameters=(
            Parameter(
                "strength", "1", 0.0, 1.0, (0.0, 1.0), 1.0, "strength of the joint's servo; 0 is silent", reached=(0.0,)
            ),
        ),
        equation="torque' = strength * torque of one joint",
        residuals="The markers' distance and the direction of motion differ in the cycles that need this joint.",
        lookalikes=("joint-zero", "compliance"),
        sentence="the servo of {joint} is weak or silent",
        measurement="switch the robot on, hold it up and press against {joint} by hand",
        starts=((0.8,), (0.4,), (0.0,)),
        apply=apply,
    )
)
