"""The camera's scale is off: all that it sees is larger or smaller."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.plant import Sighting


def apply(seen: Sighting, scale: float) -> Sighting:
    """All places as a multiple."""
    return replace(seen, point_m=seen.point_m * (1.0 + scale))


EFFECT = Effect(
    name="camera-scale",
    stage="sight",
    parameters=(Parameter("scale", "1", -0.4, 0.4, (-0.1, 0.1), 0.0, "by what share all distances are seen too long"),),
    equation="p' = (1 + scale) p",
    residuals="Displacements and the markers' distance are off by the same share.",
    lookalikes=("marker-offset", "tilted-camera"),
    sentence="the camera's scale is off",
    measurement="lay a ruler into the picture",
    apply=apply,
)
