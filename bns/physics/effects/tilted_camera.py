"""The camera does not look straight down: distances look too short on one side of the floor.

Only the perspective part of the projection, about the origin of the tracked frame. The shift, scale and rotation that come
with a tilt belong to the calibration, or to `camera-scale` and `camera-rotation`.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import View, Wheels

_NEAREST = 0.05


def apply(view: View, x_per_m: float, y_per_m: float) -> View:
    """Positions divided by 1 + ``x_per_m``·x + ``y_per_m``·y; headings distorted likewise."""
    x, y, heading = np.moveaxis(view.poses, -1, 0)
    depth = np.maximum(1.0 + x_per_m * x + y_per_m * y, _NEAREST)
    cos, sin = np.cos(heading), np.sin(heading)
    recedes = (x_per_m * cos + y_per_m * sin) / depth
    ahead, left = 1.0 - recedes * (cos * x + sin * y), -recedes * (cos * y - sin * x)
    return View(np.stack([x / depth, y / depth, heading + np.arctan2(left, ahead)], axis=-1))


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """A few percent of the picture's width, in both directions."""
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
            "fraction by which lengths shrink per metre east",
            resolution=1e-4,
        ),
        Parameter(
            "y_per_m",
            "1/m",
            -2.0,
            2.0,
            (-0.5, 0.5),
            0.0,
            "fraction by which lengths shrink per metre north",
            resolution=1e-4,
        ),
    ),
    equation="x' = x/(1 + p·x + q·y), y' = y/(1 + p·x + q·y); headings turn likewise",
    residuals="Distances are too short on one side of the floor and too long on the other; the error changes linearly.",
    lookalikes=("lens-distortion", "camera-scale", "tether-pull"),
    sentence="the camera is tilted, so that distances on one side of its picture look too short",
    measurement="track a bar of known length in the four corners of the floor",
    assumes="tilted-camera: the headings are assumed to come from the same picture, and so to be distorted with it. If a "
    "gyro or a compass measures them, the numbers are wrong.",
    apply=apply,
    needs="track",
    needs_place=True,
    starts_from=starts_from,
)
