"""The camera does not look straight down: one side of the picture is larger than the other.

A rotation of the camera about its own axis rotates everything alike, so that nothing changes as seen from the robot.
"""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Sighting


def apply(seen: Sighting, east_1_m: float, north_1_m: float) -> Sighting:
    """Positions in perspective; the origin stays where it is."""
    larger = 1.0 + east_1_m * seen.point_m[..., :1] + north_1_m * seen.point_m[..., 1:]
    return replace(seen, point_m=seen.point_m * larger)


EFFECT = Effect(
    name="tilted-camera",
    stage="sight",
    parameters=(
        Parameter(
            "east_1_m",
            "1/m",
            -0.3,
            0.3,
            (-0.1, 0.1),
            0.0,
            "fraction by which the picture grows per metre east",
        ),
        Parameter("north_1_m", "1/m", -0.3, 0.3, (-0.1, 0.1), 0.0, "fraction by which the picture grows per metre north"),
    ),
    equation="p' = p (1 + east x + north y)",
    residuals="The distance between markers depends on where in the picture they are.",
    lookalikes=("camera-scale",),
    sentence="the camera does not look straight down",
    measurement="place a ruler in each corner of the camera's view and compare the tracked lengths",
    apply=apply,
)
