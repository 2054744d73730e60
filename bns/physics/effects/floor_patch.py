"""A round patch of floor on which the robot is slower: the edge of a carpet, oil, a wet spot.

A step that crosses the rim is slowed for the part of its time that it is inside.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Body, Wheels

_RIM = 0.03
"""Half the width of the rim, in wheelbases: about half the length of a wheel's contact with the floor. A sharper rim would make
the loss jagged, since a robot that turns on the spot there is inside or outside by the tracker's noise."""
_ROUNDS = 3
"""How far a step leads depends on how much of it is inside: each round adds a power of the loss."""
_PIECE_S, _FEWEST = 0.4, 50
"""Long enough that a pose's noise is small against the way, short enough to lie at one place."""
_SIDE, _RADII, _TRIED = 13, (0.06, 0.1, 0.15, 0.22, 0.3), 4
"""Discs that are looked at: centres a side, radii in diagonals of the floor; and how many of them begin a fit."""


def apply(body: Body, x_m: float, y_m: float, radius_m: float, loss: float) -> Body:
    """All velocities times 1 - ``loss`` within ``radius_m`` of the centre."""
    if body.place is None:
        return body  # first round of a simulation: nobody knows yet where the robot goes
    return body.scaled(1.0 - loss * share_inside(body, body.place[..., :2], body.forward_m_s, (x_m, y_m), radius_m, loss))


def share_inside(
    body: Body, place: Array, speed_m_s: Array, centre_m: tuple[float, float], radius_m: float, loss: float
) -> Array:
    """For which share of each step a point of the robot at ``place`` (batch, steps, 2), with that speed, is on the patch."""
    assert body.place is not None
    east, north, heading = place[..., 0] - centre_m[0], place[..., 1] - centre_m[1], body.place[..., 2]
    away = np.hypot(east, north)
    half = np.zeros_like(away) if body.step_s is None else speed_m_s * body.step_s / 2.0
    outwards = half * (east * np.cos(heading) + north * np.sin(heading)) / np.maximum(away, 1e-9)
    inside, rim = np.ones_like(away), _RIM * body.wheelbase_m
    for _ in range(_ROUNDS):
        reach = np.hypot(outwards * (1.0 - loss * inside), rim)
        way = np.clip((radius_m - away) / (2.0 * reach) + 0.5, 0.0, 1.0)
        inside = way / (way + (1.0 - loss) * (1.0 - way))  # what is slower takes longer
    return inside


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """The discs in which the tracked distance differs most from the commanded one, relative to it, from the floor around."""
    middle, told, seen = _ways(wheels)
    if len(told) < _FEWEST:
        return ()
    low, high = (np.quantile(middle, q, axis=0) for q in (0.03, 0.97))
    east, north = (np.linspace(low[i], high[i], _SIDE) for i in (0, 1))
    centres = np.stack(np.meshgrid(east, north), axis=-1).reshape(-1, 2)
    away = np.hypot(*(middle[None] - centres[:, None]).transpose(2, 0, 1))
    found = []
    for radius in np.array(_RADII) * float(np.hypot(*(high - low))):
        inside = (away < radius).astype(float)
        way, got = inside @ told, inside @ seen
        rest, kept = told.sum() - way, seen.sum() - got
        with np.errstate(divide="ignore", invalid="ignore"):
            loss = 1.0 - (got / way) / (kept / rest)
            score = np.nan_to_num(loss**2 * way * rest / told.sum(), posinf=0.0)
        found += [
            (score[i], (*centres[i].tolist(), float(radius), float(np.clip(loss[i], -0.9, 0.9))))
            for i in [int(score.argmax())]
        ]
    return tuple(start for _, start in sorted(found, reverse=True)[:_TRIED])


def _ways(wheels: Wheels) -> tuple[Array, Array, Array]:
    """Pieces of about `_PIECE_S`: their positions (n, 2), and the commanded and tracked distances of the robot's centre (n,)."""
    if wheels.conditions.seen is None:
        return np.zeros((0, 2)), np.zeros(0), np.zeros(0)
    typical = float(np.median(wheels.step_s[wheels.step_s > 0]))
    k = max(round(_PIECE_S / typical), 1)
    driven = np.abs(wheels.left_m_s + wheels.right_m_s) / 2.0 * wheels.step_s
    way = np.cumsum(driven, axis=1) - driven / 2.0
    places, known = wheels.conditions.seen[..., :2], wheels.trial_s
    told, seen = way[:, k::k] - way[:, :-k:k], np.hypot(*np.diff(places[:, ::k], axis=1).transpose(2, 0, 1))
    lasted = known[:, k::k] - known[:, :-k:k]
    middle = (places[:, :-k:k] + places[:, k::k]) / 2.0
    good = np.isfinite(seen) & (told > 0.02 * np.quantile(told, 0.9)) & (lasted < 3 * _PIECE_S)
    return middle[good], told[good], seen[good]


EFFECT = Effect(
    name="floor-patch",
    stage="body",
    parameters=(
        Parameter("x_m", "m", -1e4, 1e4, (-1e3, 1e3), 0.0, "centre of the patch, east", resolution=2e-3, jagged=True),
        Parameter("y_m", "m", -1e4, 1e4, (-1e3, 1e3), 0.0, "centre of the patch, north", resolution=2e-3, jagged=True),
        Parameter(
            "radius_m",
            "m",
            5e-3,
            1e3,
            (0.02, 100.0),
            0.2,
            "radius of the patch",
            floor_share=0.33,
            resolution=2e-3,
            jagged=True,
        ),
        Parameter("loss", "1", -1.0, 0.99, (-0.5, 0.95), 0.0, "fraction of speed lost on it (negative: gained)"),
    ),
    equation="v, s, omega times 1 - k where (x - px)^2 + (y - py)^2 < r^2",
    residuals="All velocities are too small by one fraction in one area of the floor, at any heading; elsewhere trials fit.",
    lookalikes=("tether-pull", "lens-distortion"),
    sentence="the robot is slower on one patch of the floor",
    sized="the robot is {loss:slower|faster} on one patch of the floor, {radius_m} in radius",
    measurement="inspect the floor there, or repeat trials from a start moved by twice the diameter of the patch",
    apply=apply,
    revision=3,
    needs="track",
    needs_place=True,
    starts_from=starts_from,
)
