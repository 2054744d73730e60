"""Radial distortion left after the lens was calibrated: scale changes with the squared distance from the lens's centre."""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import View, Wheels


def apply(view: View, per_m2: float, x_m: float, y_m: float) -> View:
    """Positions moved away from the centre by the fraction ``per_m2``·r^2 of their distance r; headings distorted likewise."""
    x, y, heading = np.moveaxis(view.poses, -1, 0)
    east, north = x - x_m, y - y_m
    share = per_m2 * (east**2 + north**2)
    cos, sin = np.cos(heading), np.sin(heading)
    along, across = cos * east + sin * north, cos * north - sin * east
    turned = np.arctan2(2.0 * per_m2 * along * across, 1.0 + share + 2.0 * per_m2 * along**2)
    return View(np.stack([x + share * east, y + share * north, heading + turned], axis=-1))


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """A few percent at the edge of the floor, either way, about its middle."""
    low, middle, high = (np.quantile(wheels.places, q, axis=0) for q in (0.02, 0.5, 0.98))
    small = 0.03 / max(float(np.hypot(*(high - low)) / 2.0) ** 2, 1e-4)
    return tuple((sign * small, float(middle[0]), float(middle[1])) for sign in (1.0, -1.0))


EFFECT = Effect(
    name="lens-distortion",
    stage="measure",
    parameters=(
        Parameter(
            "per_m2",
            "1/m^2",
            -2.0,
            2.0,
            (-0.3, 0.3),
            0.0,
            "fraction by which a point 1 m from the centre is moved outwards",
            resolution=1e-4,
        ),
        Parameter("x_m", "m", -1e3, 1e3, (-100.0, 100.0), 0.0, "centre of the lens, east", floor_axis="x", resolution=5e-3),
        Parameter("y_m", "m", -1e3, 1e3, (-100.0, 100.0), 0.0, "centre of the lens, north", floor_axis="y", resolution=5e-3),
    ),
    equation="x' = x + k·r^2·(x - cx), y' = y + k·r^2·(y - cy), r the distance from (cx, cy); headings turn likewise",
    residuals="Distances are right in the middle of the floor, and wrong by the same fraction all round its edge.",
    lookalikes=("tilted-camera", "camera-scale"),
    sentence="the camera's lens distorts the edges of its picture",
    measurement="calibrate the lens with a chessboard, or film a straight edge along the border of the picture",
    assumes="lens-distortion: the headings are assumed to come from the same picture, and so to be distorted with it. If a "
    "gyro or a compass measures them, the numbers are wrong.",
    apply=apply,
    needs="track",
    needs_place=True,
    starts_from=starts_from,
)
