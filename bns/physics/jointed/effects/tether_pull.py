"""The tether pulls its link towards one point, with a force that grows with the distance from it."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, east_n: float, north_n: float, return_n_m: float) -> Plant:
    """The force at the origin, and its decrease per metre."""
    pull = (plant.pull_n[0] + east_n, plant.pull_n[1] + north_n)
    return replace(plant, pull_n=pull, return_n_m=plant.return_n_m + return_n_m)


EFFECT = Effect(
    name="tether-pull",
    stage="mechanics",
    parameters=(
        Parameter("east_n", "N", -5.0, 5.0, (-1.0, 1.0), 0.0, "force towards east at the camera's origin"),
        Parameter("north_n", "N", -5.0, 5.0, (-1.0, 1.0), 0.0, "force towards north at the camera's origin"),
        Parameter(
            "return_n_m",
            "N/m",
            -5.0,
            5.0,
            (-1.0, 1.0),
            0.0,
            "increase of the force per metre from that point",
        ),
    ),
    equation="F = (east, north) - return * (x, y) on the tether's link; it is zero at (east, north) / return",
    residuals="The end that carries the tether is pulled towards one point.",
    lookalikes=("floor-slope", "tether-drag"),
    sentence="the tether pulls the robot towards one point",
    measurement="hold the tether up, or hang it from a boom, and repeat some trials",
    apply=apply,
)
