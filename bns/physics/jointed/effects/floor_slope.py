"""The floor slopes: gravity pulls the robot along it."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, east_rad: float, north_rad: float) -> Plant:
    """The slope towards east and north added."""
    return replace(plant, slope=(plant.slope[0] + east_rad, plant.slope[1] + north_rad))


EFFECT = Effect(
    name="floor-slope",
    stage="mechanics",
    parameters=(
        Parameter("east_rad", "rad", -0.2, 0.2, (-0.06, 0.06), 0.0, "downward slope towards east"),
        Parameter("north_rad", "rad", -0.2, 0.2, (-0.06, 0.06), 0.0, "downward slope towards north"),
    ),
    equation="F = m g (east, north) on every link",
    residuals="The robot ends farther down the slope than predicted, at any heading.",
    lookalikes=("tether-pull",),
    sentence="the floor is not level",
    measurement="lay a spirit level on the floor, in two directions",
    beside={"tether-pull": "A slope acts on all links, a tether on one: lift the tether and repeat some trials."},
    apply=apply,
)
