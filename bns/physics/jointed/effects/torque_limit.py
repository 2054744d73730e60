"""The torque limit of the servos is lower, or higher, than the model's."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, factor: float) -> Plant:
    """The torque limit of all joints, as a multiple."""
    return replace(plant, torque=plant.torque * factor)


EFFECT = Effect(
    name="torque-limit",
    stage="mechanics",
    parameters=(
        Parameter(
            "factor", "1", 0.05, 2.0, (0.1, 1.0), 1.0, "torque limit of the servos, as a multiple of the model's"
        ),
    ),
    equation="|torque| <= factor * limit",
    residuals="Postures that lift the body high are not reached; flat ones fit.",
    lookalikes=("compliance", "supply-sag", "servo-speed-limit"),
    sentence="the servos' highest torque differs from the model's",
    sized="the servos' highest torque is {factor:higher|lower} than the model's",
    measurement="hang weights on a servo's arm, and note the torque at which it yields",
    starts=((0.63,), (0.25,), (0.1,)),
    apply=apply,
)
