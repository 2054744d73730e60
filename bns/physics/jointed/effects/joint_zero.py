"""One joint's zero is off: a horn put on by a tooth too far. Which one is part of the effect's name."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.catalogue_parts import PerJoint
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, joint: str, offset_rad: float) -> Plant:
    """One joint that is elsewhere than it believes."""
    return plant.with_joint("zero_rad", joint, offset_rad)


EFFECT = PerJoint(
    Effect(
        name="joint-zero",
        stage="mechanics",
        parameters=(
            Parameter(
                "offset_rad", "rad", -0.8, 0.8, (-0.4, 0.4), 0.0, "where the joint is when it believes to be at 0"
            ),
        ),
        equation="angle' = angle + offset of one joint",
        residuals="The robot curves to one side, or lies bent, in every cycle alike.",
        lookalikes=("weak-joint", "marker-offset"),
        sentence="the zero of {joint} is off",
        measurement="tell all joints to be straight and look at {joint} along the body",
        apply=apply,
    )
)
