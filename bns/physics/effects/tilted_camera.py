"""The camera does not look straight down: what is far from it in one direction looks too small.

The projective part of the picture alone, about the origin of the tracked frame: the shift, scale and turn that go with it
are the calibration's, or `camera-scale` and `camera-rotation`.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import View, Wheels

_NEAREST = 0.05


def apply(view: View, x_per_m: float, y_per_m: float) -> View:
    """Positions divided by 1 + ``x_per_m``·x + ``y_per_m``·y; headings as the same picture shows them."""
    x, y, heading = np.moveaxis(view.poses, -1, 0)
    depth = np.maximum(1.0 + x_per_m * x + y_per_m * y, _NEAREST)
    cos, sin = np.cos(heading), np.sin(heading)
    recedes = (x_per_m * cos + y_per_m * sin) / depth
    ahead, left = 1.0 - recedes * (cos * x + sin * y), -recedes * (cos * y - sin * x)
    return View(np.stack([x / depth, y / depth, heading + np.arctan2(left, ahead)], axis=-1))


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """A few percent of the picture's width either way."""
    small = 0.03 / max(float(np.ptp(wheels.places, axis=0).max()), 1e-2)
    return ((small, 0.0), (-small, 0.0), (0.0, small), (0.0, -small))


EFFECT = Effect(
    name="tilted-camera",
    stage="measure",
    parameters=(
        Parameter(
            "x_per_m",
            "1/m",
            -2.0,
            2.0,
            (-0.5, 0.5),
            0.0,
            "share that lengths shrink a metre further east",
            resolution=1e-4,
        ),
        Parameter(
            "y_per_m",
            "1/m",
            -2.0,
            2.0,
            (-0.5, 0.5),
            0.0,
            "share that lengths shrink a metre further north",
            resolution=1e-4,
        ),
    ),
    equation="x' = x/(1 + p·x + q·y), y' = y/(1 + p·x + q·y)",
    residuals="Distances are too small on one side of the floor and too large on the other; they change in a straight line.",
    lookalikes=("lens-distortion", "camera-scale", "tether-pull"),
    sentence="the camera is tilted, so that distances on one side of its picture look shorter",
    measurement="track a stick of known length at the four corners of the floor",
    apply=apply,
    needs="track",
    needs_place=True,
    starts_from=starts_from,
)
