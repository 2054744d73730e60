"""Iron or magnets on the robot turn its compass: headings are off by an angle that goes round with the heading ("hard iron").

A field that is fixed to the robot adds to that of the earth. What iron that is not magnetic does, with half the period, is not
in it.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import View

_TEXT = "field of the robot, divided by the earth's horizontal field, that adds to the heading's"


def apply(view: View, cosine_share: float, sine_share: float) -> View:
    """Headings as the direction of (cos + ``cosine_share``, sin + ``sine_share``); places unchanged."""
    poses = view.poses.copy()
    cos, sin = np.cos(view.poses[..., 2]), np.sin(view.poses[..., 2])
    along, across = cosine_share * cos + sine_share * sin, sine_share * cos - cosine_share * sin
    poses[..., 2] += np.arctan2(across, 1.0 + along)
    return View(poses)


EFFECT = Effect(
    name="compass-deviation",
    stage="measure",
    parameters=(
        Parameter("cosine_share", "1", -0.9, 0.9, (-0.5, 0.5), 0.0, f"{_TEXT} cosine", resolution=1e-4),
        Parameter("sine_share", "1", -0.9, 0.9, (-0.5, 0.5), 0.0, f"{_TEXT} sine", resolution=1e-4),
    ),
    equation="theta' = atan2(sin(theta) + q, cos(theta) + p)",
    residuals="Turns look too long through one half of the compass and too short through the other, whatever the speed.",
    lookalikes=("camera-rotation", "wheelbase", "tilted-camera"),
    sentence="the heading is turned by an angle that depends on the heading itself (a compass near iron or magnets)",
    measurement="turn the robot by hand in steps of 45 degrees on a marked floor, and log its headings",
    apply=apply,
    needs="track",
    needs_place=True,
    starts=((0.05, 0.0), (-0.05, 0.0), (0.0, 0.05), (0.0, -0.05)),
)
