"""The tracked point is not above the midpoint of the axle.

A robot that turns about a point ahead of or behind its axle (skid-steer: the instantaneous centre of rotation) leaves the
same log: a centre of rotation x ahead of the tracked point equals a marker at forward -x.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import View


def apply(view: View, forward_m: float, left_m: float) -> View:
    """Positions moved by the offset, which rotates with the robot; headings unchanged."""
    cos, sin = np.cos(view.poses[..., 2]), np.sin(view.poses[..., 2])
    poses = view.poses.copy()
    poses[..., 0] += cos * forward_m - sin * left_m
    poses[..., 1] += sin * forward_m + cos * left_m
    return View(poses)


EFFECT = Effect(
    name="marker-offset",
    stage="measure",
    parameters=(
        Parameter("forward_m", "m", -1.0, 1.0, (-0.3, 0.3), 0.0, "marker ahead of the midpoint of the axle", size_power=1.0),
        Parameter(
            "left_m", "m", -1.0, 1.0, (-0.3, 0.3), 0.0, "marker to the left of the midpoint of the axle", size_power=1.0
        ),
    ),
    equation="x' = x + f·cos(theta) - s·sin(theta), y' = y + f·sin(theta) + s·cos(theta)",
    residuals="Turns on the spot move the tracked point on a circle; straight commands fit.",
    lookalikes=("side-slip", "turn-slip"),
    sentence="the tracked point is not the point about which the robot turns (the midpoint of the axle in the model)",
    sized="the tracked point is not the point about which the robot turns, but {forward_m:+ahead of it|behind it} and "
    "{left_m:+to its left|to its right}",
    measurement="measure the position of the marker from the midpoint of the axle with a ruler",
    or_of_robot="the robot turns about another point than the midpoint of its axle, as skid-steered robots do, and the marker is "
    "where it should be. A ruler tells which: the measured position of the marker from the midpoint of the axle is either this "
    "offset or not",
    apply=apply,
)
