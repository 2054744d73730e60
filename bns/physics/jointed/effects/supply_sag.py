"""The supply voltage drops under load: the more torque all servos give, the weaker they become."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, sag: float) -> Plant:
    """The fraction lost when all servos give their full torque."""
    return replace(plant, sag=plant.sag + sag)


EFFECT = Effect(
    name="supply-sag",
    stage="mechanics",
    parameters=(
        Parameter("sag", "1", 0.0, 1.0, (0.0, 0.95), 0.0, "fraction of stiffness and torque lost under full load"),
    ),
    equation="torque' = torque * (1 - sag * mean load)",
    residuals="Cycles in which many joints are under load move the robot less than predicted.",
    lookalikes=("compliance", "torque-limit"),
    sentence="the supply voltage drops when the servos are under load",
    measurement="log the voltage that the servos measure while the robot moves",
    starts=((0.19,), (0.57,), (0.95,)),
    apply=apply,
)
