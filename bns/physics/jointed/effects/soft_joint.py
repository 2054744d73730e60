"""One servo is softer, with its full torque: a lower gain of its position loop. The effect's name ends in the joint.

A weak servo is the same where its torque limit is never reached, so this takes the place of `weak-joint` where data speak for it.
"""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.catalogue_parts import PerJoint
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, joint: str, strength: float) -> Plant:
    """Stiffness and the servo's own damping of one joint, as a fraction; its torque limit unchanged."""
    for values in ("stiffness", "damping"):
        plant = plant.with_joint(values, joint, strength)
    return plant


EFFECT = PerJoint(
    Effect(
        name="soft-joint",
        stage="mechanics",
        parameters=(
            Parameter("strength", "1", 0.0, 1.0, (0.0, 1.0), 1.0, "gain of the servo's position loop over that in the model"),
        ),
        equation="torque' = strength * k * error of one joint, up to the same limit",
        residuals="The joint lags and sags as a weak one does, but large errors are corrected with full torque.",
        lookalikes=("weak-joint", "compliance", "joint-friction"),
        sentence="the servo of {joint} is softer than in the model, and as strong",
        measurement="read the gain of the position loop from the servo of {joint}; or turn it by hand by a small angle, and "
        "compare the torque with that of its neighbours",
        starts=((0.8,), (0.4,)),
        extends="weak-joint",
        apply=apply,
    ),
    limited=True,
)
