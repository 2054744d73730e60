"""The camera's scale is wrong: it reports every distance too long or too short."""

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
    parameters=(Parameter("scale", "1", -0.4, 0.4, (-0.1, 0.1), 0.0, "fraction by which all distances are reported too long"),),
    equation="p' = (1 + scale) p",
    residuals="Displacements and the distance between markers are off by the same fraction.",
    lookalikes=("marker-offset", "tilted-camera"),
    sentence="the camera reports all distances too long or too short by one factor",
    sized="the camera reports all distances {scale:too long|too short}",
    measurement="place a ruler in the camera's view and compare its length with the tracked one",
    apply=apply,
)
