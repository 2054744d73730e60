"""The zero of one joint is off, as when a servo horn is mounted one tooth too far. The effect's name ends in the joint."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.catalogue_parts import PerJoint
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, joint: str, offset_rad: float) -> Plant:
    """The angle of one joint offset."""
    return plant.with_joint("zero_rad", joint, offset_rad)


EFFECT = PerJoint(
    Effect(
        name="joint-zero",
        stage="mechanics",
        parameters=(
            Parameter(
                "offset_rad", "rad", -0.8, 0.8, (-0.4, 0.4), 0.0, "true angle of the joint when its servo reports 0"
            ),
        ),
        equation="angle' = angle + offset of one joint",
        residuals="The robot turns to one side, or its body is bent, in every cycle alike.",
        lookalikes=("weak-joint", "marker-offset"),
        sentence="the zero of {joint} is off",
        measurement="command all joints to zero, look along the body, and measure the angle at {joint}",
        apply=apply,
    )
)
