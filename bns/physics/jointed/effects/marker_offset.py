"""A marker is not where the model has it. The effect's name ends in the marker."""

from __future__ import annotations

from dataclasses import replace

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.catalogue_parts import PerSite
from bns.physics.jointed.plant import Sighting


def apply(seen: Sighting, site: int, along_m: float, left_m: float) -> Sighting:
    """One tracked point moved on its link."""
    points = seen.point_m.copy()
    points[..., site, :] += along_m * seen.along[..., site, :] + left_m * seen.left[..., site, :]
    return replace(seen, point_m=points)


EFFECT = PerSite(
    Effect(
        name="marker-offset",
        stage="sight",
        parameters=(
            Parameter(
                "along_m", "m", -0.2, 0.2, (-0.08, 0.08), 0.0, "marker ahead of its position in the model"
            ),
            Parameter("left_m", "m", -0.2, 0.2, (-0.08, 0.08), 0.0, "marker to the left of its position in the model"),
        ),
        equation="p' = p + along * a + left * l, a and l the link's axes",
        residuals="The distance between markers is off in every posture; rotations of that link move the marker more, or less.",
        lookalikes=("camera-scale", "joint-zero"),
        sentence="the marker {site} is not where the model has it",
        measurement="measure the position of {site} on its link with a ruler",
        apply=apply,
    )
)
