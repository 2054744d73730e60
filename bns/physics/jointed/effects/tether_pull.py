"""The tether pulls its link towards a place, the harder the farther away that is."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, east_n: float, north_n: float, return_n_m: float) -> Plant:
    """The pull at the origin and what it loses with every metre."""
    pull = (plant.pull_n[0] + east_n, plant.pull_n[1] + north_n)
    return replace(plant, pull_n=pull, return_n_m=plant.return_n_m + return_n_m)


EFFECT = Effect(
    name="tether-pull",
    stage="mechanics",
    parameters=(
        Parameter("east_n", "N", -5.0, 5.0, (-1.0, 1.0), 0.0, "pull towards east where the camera's origin is"),
        Parameter("north_n", "N", -5.0, 5.0, (-1.0, 1.0), 0.0, "pull towards north there"),
        Parameter(
            "return_n_m",
            "N/m",
            -5.0,
            5.0,
            (-1.0, 1.0),
            0.0,
            "what the pull grows by with every metre away from its place",
        ),
    ),
    equation="F = (east, north) - return * (x, y) on the tether's link; it vanishes at (east, north) / return",
    residuals="The end that carries the tether is drawn to one place.",
    lookalikes=("floor-slope", "tether-drag"),
    sentence="the tether pulls the robot towards a place",
    measurement="hold the tether up, or hang it from a boom, and repeat some trials",
    apply=apply,
)
