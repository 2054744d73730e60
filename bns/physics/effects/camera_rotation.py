"""The tracker's x axis and the zero of its headings do not agree, or the marker is put on the robot turned."""

from __future__ import annotations

import math

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import View


def apply(view: View, angle_rad: float) -> View:
    """Positions turned about the origin by ``angle_rad``, counter-clockwise; headings as they are."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    poses = view.poses.copy()
    poses[..., 0] = cos * view.poses[..., 0] - sin * view.poses[..., 1]
    poses[..., 1] = sin * view.poses[..., 0] + cos * view.poses[..., 1]
    return View(poses)


EFFECT = Effect(
    name="camera-rotation",
    stage="measure",
    parameters=(
        Parameter(
            "angle_rad",
            "rad",
            -3.2,
            3.2,
            (-3.15, 3.15),
            0.0,
            "positions turned against headings, left positive",
            resolution=2e-3,
        ),
    ),
    equation="x' = x·cos(phi) - y·sin(phi), y' = x·sin(phi) + y·cos(phi)",
    residuals="The robot seems to drive at an angle to its heading, the same one always, also in reverse.",
    lookalikes=("side-slip", "marker-offset"),
    sentence="the camera's positions are turned against the robot's headings",
    measurement="track a straight edge laid along the direction that the headings call north",
    apply=apply,
    starts=tuple(
        (sign * a,)
        for a in (0.01, 0.05, 0.2, 0.5, math.pi / 4, math.pi / 2, 3 * math.pi / 4, math.pi)
        for sign in (1, -1)
    ),
    needs="track",
)
