"""A round patch of floor on which the robot is slower: a carpet's edge, oil, a wet spot. Its rim is a tenth of its radius wide."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Body

_RIM = 0.1


def apply(body: Body, x_m: float, y_m: float, radius_m: float, loss: float) -> Body:
    """All velocities times 1 - ``loss`` within ``radius_m`` of the place."""
    if body.place is None:
        return body  # first round of a simulation: nobody knows yet where the robot goes
    away = np.hypot(body.place[..., 0] - x_m, body.place[..., 1] - y_m)
    inside = np.clip((radius_m - away) / (_RIM * radius_m) + 0.5, 0.0, 1.0)
    return body.scaled(1.0 - loss * inside)


def starts_from(places: NDArray[np.float64]) -> tuple[tuple[float, ...], ...]:
    """A third of the floor's width across, at nine places of it."""
    low, middle, high = (np.quantile(places, q, axis=0) for q in (0.2, 0.5, 0.8))
    radius = max(0.4 * float(np.hypot(*(high - low))) / 2.0, 0.02)
    return tuple(
        (float(x[0]), float(y[1]), radius, 0.1) for x in (low, middle, high) for y in (low, middle, high)
    )


EFFECT = Effect(
    name="floor-patch",
    stage="body",
    parameters=(
        Parameter("x_m", "m", -1e4, 1e4, (-1e3, 1e3), 0.0, "middle of the patch, east", resolution=2e-3),
        Parameter("y_m", "m", -1e4, 1e4, (-1e3, 1e3), 0.0, "middle of the patch, north", resolution=2e-3),
        Parameter("radius_m", "m", 5e-3, 1e3, (0.02, 100.0), 0.2, "of the patch", resolution=2e-3),
        Parameter("loss", "1", -1.0, 0.99, (-0.5, 0.95), 0.0, "share of speed lost on it (negative: faster)"),
    ),
    equation="v, s, omega times 1 - k where (x - px)^2 + (y - py)^2 < r^2",
    residuals="All velocities are too small by one share at one place of the floor, whatever the heading; elsewhere all fits.",
    lookalikes=("tether-pull", "lens-distortion"),
    sentence="there is a patch of floor on which the robot is slower",
    measurement="look at the floor there, or repeat trials with the start moved by twice the patch",
    apply=apply,
    needs="track",
    needs_place=True,
    starts_from=starts_from,
)
