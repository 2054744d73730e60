"""All joints are softer or stiffer than the model's."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, stiffness: float) -> Plant:
    """The stiffness of all joints, as a multiple."""
    return replace(plant, stiffness=plant.stiffness * stiffness)


EFFECT = Effect(
    name="compliance",
    stage="mechanics",
    parameters=(
        Parameter("stiffness", "1", 0.1, 6.0, (0.3, 3.0), 1.0, "stiffness of the servos, as a multiple of that in the model"),
    ),
    equation="torque = stiffness * k * error",
    residuals="Lifted parts sag, so that the distance between markers differs from the model's; more so when lifted higher.",
    lookalikes=("torque-limit", "supply-sag", "dead-band", "dry-friction"),
    sentence="the joints are softer or stiffer than the model's",
    sized="the joints are {stiffness:stiffer|softer} than the model's",
    measurement="hang a known weight on an arm that a servo holds level, and measure how far it sinks",
    starts=((0.79,), (0.49,), (1.25,), (1.93,)),
    apply=apply,
)
