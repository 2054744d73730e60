"""The tracker's x axis differs from the zero of its headings, or the marker is mounted rotated on the robot."""

from __future__ import annotations

import math

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import View


def apply(view: View, angle_rad: float) -> View:
    """Positions rotated about the origin by ``angle_rad``, counter-clockwise; headings unchanged."""
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
            "rotation of positions relative to headings, counter-clockwise positive; of markers that are mounted turned, the "
            "opposite of their angle on the robot",
            resolution=2e-3,
        ),
    ),
    equation="x' = x·cos(phi) - y·sin(phi), y' = x·sin(phi) + y·cos(phi)",
    residuals="The robot appears to drive at a constant angle to its heading, also in reverse.",
    lookalikes=("side-slip", "marker-offset"),
    sentence="the tracker's positions are rotated relative to its headings (its axes are turned, or the markers on the robot)",
    sized="the tracker's positions are rotated {angle_rad:to the left|to the right} relative to its headings (its "
    "axes are turned, or the markers on the robot)",
    measurement="compare the tracked heading with a straight edge along the robot; or "
    "lay a straight edge along heading zero, track both of its ends, and measure its angle to the x axis",
    or_of_robot="the robot drives at this angle to its axis, as with a wheel that is toed in. The tracked heading of a robot "
    "that stands along a straight edge tells which",
    apply=apply,
    starts=tuple(
        (sign * a,)
        for a in (0.01, 0.05, 0.2, 0.5, math.pi / 4, math.pi / 2, 3 * math.pi / 4, math.pi)
        for sign in (1, -1)
    ),
    needs="track",
)
