"""A sensor on the robot, which measures motions in its own frame, is mounted rotated relative to the robot.

For single relative motions only (scan matching). With a tracker that reports poses in one frame, the same error is
`camera-rotation`. The sensor's position is `marker-offset`, in the robot's frame: it acts before the rotation.
"""

from __future__ import annotations

import math

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import View


def apply(view: View, angle_rad: float) -> View:
    """Headings as the sensor has them: ``angle_rad`` to the left of the robot's; displacements in its frame follow."""
    poses = view.poses.copy()
    poses[..., 2] += angle_rad
    return View(poses)


EFFECT = Effect(
    name="sensor-rotation",
    stage="measure",
    parameters=(
        Parameter(
            "angle_rad",
            "rad",
            -3.2,
            3.2,
            (-3.15, 3.15),
            0.0,
            "angle from the robot's x axis to the sensor's, counter-clockwise positive",
            resolution=1e-3,
        ),
    ),
    equation="theta' = theta + a: the displacement in the sensor's frame is the robot's, rotated by -a",
    residuals="Every displacement points away from straight ahead by the same angle, also in reverse.",
    lookalikes=("side-slip", "marker-offset"),
    sentence="the sensor is mounted rotated relative to the robot",
    sized="the sensor is mounted rotated {angle_rad:to the left|to the right} relative to the robot",
    measurement="drive straight along a wall, and measure the wall's direction in the sensor's data",
    apply=apply,
    needs="motions",
    starts=tuple(
        (sign * a,) for a in (0.01, 0.1, math.pi / 4, math.pi / 2, 3 * math.pi / 4, math.pi) for sign in (1, -1)
    ),
)
