"""The camera looks at the floor slantwise: one side of the picture is larger than the other.

A camera that is only turned about its own axis turns everything alike: seen from the robot nothing changes.
"""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Sighting


def apply(seen: Sighting, east_1_m: float, north_1_m: float) -> Sighting:
    """Places drawn out in perspective, which leaves the origin as it is."""
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
            "by what share the picture grows with every metre towards east",
        ),
        Parameter("north_1_m", "1/m", -0.3, 0.3, (-0.1, 0.1), 0.0, "the same towards north"),
    ),
    equation="p' = p (1 + east x + north y)",
    residuals="The markers' distance depends on where in the picture they are.",
    lookalikes=("camera-scale",),
    sentence="the camera does not look straight down",
    measurement="lay a ruler into the corners of the picture",
    apply=apply,
)
