"""The robot drags the tether along: its friction brakes the link that carries it."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, drag_n: float) -> Plant:
    """More drag on the tether's link."""
    return replace(plant, drag_n=plant.drag_n + drag_n)


EFFECT = Effect(
    name="tether-drag",
    stage="mechanics",
    parameters=(Parameter("drag_n", "N", -0.2, 3.0, (-0.05, 1.0), 0.0, "drag of the tether in addition to the model's"),),
    equation="F = -drag * v / |v| on the tether's link",
    residuals="The end that carries the tether moves less than predicted.",
    lookalikes=("uneven-mass", "floor-friction"),
    sentence="the drag of the tether is higher than in the model",
    measurement="drag the tether alone over the floor with a spring balance and read the force",
    apply=apply,
)
