"""A picture that is stretched along one direction: pixels that are not square, or axes that are not at right angles.

With `camera-scale` and `camera-rotation`, which are the other two parts of a linear map, this is whatever a calibration from too
few points leaves of it.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import View


def apply(view: View, stretch: float, shear: float) -> View:
    """Positions times (1 + ``stretch``, ``shear``; ``shear``, 1 - ``stretch``); headings distorted likewise."""
    x, y, heading = np.moveaxis(view.poses, -1, 0)
    cos, sin = np.cos(2.0 * heading), np.sin(2.0 * heading)
    turned = np.arctan2(shear * cos - stretch * sin, 1.0 + stretch * cos + shear * sin)
    east, north = x + stretch * x + shear * y, y + shear * x - stretch * y
    return View(np.stack([east, north, heading + turned], axis=-1))


EFFECT = Effect(
    name="affine-distortion",
    stage="measure",
    parameters=(
        Parameter("stretch", "1", -0.5, 0.5, (-0.1, 0.1), 0.0, "fraction by which x is too long and y too short"),
        Parameter("shear", "1", -0.5, 0.5, (-0.1, 0.1), 0.0, "the same along the diagonals: x grows with y, and y with x"),
    ),
    starts=((0.01, 0.0), (-0.01, 0.0), (0.0, 0.01), (0.0, -0.01)),
    equation="x' = x + a·x + b·y, y' = y + b·x - a·y; headings turn likewise",
    residuals="Distances are too long in one direction and too short across it, everywhere on the floor alike.",
    lookalikes=("lens-distortion", "camera-scale", "tilted-camera"),
    sentence="the tracker's picture is stretched along one direction",
    measurement="track a bar of known length along x, along y and along both diagonals of the floor",
    assumes="affine-distortion: the headings are assumed to come from the same picture, and so to be distorted with it. If a "
    "gyro or a compass measures them, the numbers are wrong.",
    apply=apply,
    needs="track",
    needs_place=True,
)
