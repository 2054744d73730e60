"""Servos give less torque, or more, before they give way."""

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
    residuals="Cycles that lift the body high are not reached; flat ones fit.",
    lookalikes=("compliance", "supply-sag", "servo-speed-limit"),
    sentence="the servos are weaker than assumed",
    measurement="hang a weight on a servo's arm until it gives way",
    starts=((0.82,), (0.46,), (0.1,)),
    apply=apply,
)
