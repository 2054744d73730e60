"""What is left of a lens's distortion: lengths grow or shrink with the squared distance from its centre."""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import View, Wheels


def apply(view: View, per_m2: float, x_m: float, y_m: float) -> View:
    """Positions moved off the centre by ``per_m2``·r^2 of their distance r; headings as the same picture shows them."""
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
            "share by which a place a metre off the centre is moved out",
            resolution=1e-4,
        ),
        Parameter("x_m", "m", -1e3, 1e3, (-100.0, 100.0), 0.0, "centre of the lens, east", resolution=5e-3),
        Parameter("y_m", "m", -1e3, 1e3, (-100.0, 100.0), 0.0, "centre of the lens, north", resolution=5e-3),
    ),
    equation="x' = x + k·r^2·(x - cx), y' = y + k·r^2·(y - cy), r the distance from (cx, cy)",
    residuals="Distances are right in the middle of the floor and wrong all round its edge, by the same share.",
    lookalikes=("tilted-camera", "camera-scale"),
    sentence="the camera's lens bends its picture towards the edges",
    measurement="calibrate the lens with a chessboard, or look at a straight edge laid along the picture's border",
    apply=apply,
    needs="track",
    needs_place=True,
    starts_from=starts_from,
)
