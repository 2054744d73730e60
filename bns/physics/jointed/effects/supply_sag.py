"""The supply gives way under load: the harder all servos pull, the weaker they are."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, sag: float) -> Plant:
    """The share that is lost when all servos pull with all they have."""
    return replace(plant, sag=plant.sag + sag)


EFFECT = Effect(
    name="supply-sag",
    stage="mechanics",
    parameters=(
        Parameter("sag", "1", 0.0, 1.0, (0.0, 0.95), 0.0, "share of stiffness and torque lost under full load"),
    ),
    equation="torque' = torque * (1 - sag * mean load)",
    residuals="Cycles in which many joints work hard reach less than foreseen.",
    lookalikes=("compliance", "torque-limit"),
    sentence="the supply's voltage drops when the servos work hard",
    measurement="log the servos' own voltage while the robot moves",
    starts=((0.19,), (0.57,), (0.95,)),
    apply=apply,
)
