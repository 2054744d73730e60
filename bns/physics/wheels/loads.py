"""Pulls on a robot whose wheels grip: what they do to its velocities, and a first guess of them from tracked poses."""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Parameter
from bns.physics.signals import Array, Body, Wheels

_PIECE_S, _FEWEST = 0.4, 50
"""Long enough that a pose's noise is small against the way, short enough to lie at one place."""

_FAR = 10.0
"""From so many diagonals of the floor away a pull that grows with the distance differs by less than a tenth across the floor:
it is a slope. An anchor that would be farther is none."""


def _anchor(axis: str, way: str) -> Parameter:
    name, text = f"anchor_{axis}_m", f"anchor of the cable, {way}"
    return Parameter(name, "m", -1e4, 1e4, (-100.0, 100.0), 0.0, text, floor_share=_FAR, floor_axis=axis)


ANCHOR = _anchor("x", "east"), _anchor("y", "north")

AT_REST = Parameter(
    "at_rest",
    "1",
    0.0,
    1.0,
    (0.0, 1.0),
    0.0,
    "share that acts while the wheels are commanded to stand",
    reached=(0.0, 1.0),
)


def pulled(
    body: Body, place: Array, east_m_s: Array | float, north_m_s: Array | float, ahead_share: float, at_rest: float
) -> Body:
    """What a force makes of a robot whose wheels give way in proportion to their load and do not slip; it drives free wheels so.

    The force acts a distance c, ``ahead_share`` wheelbases b, ahead of the axle. Along the heading both wheels share it. Across
    it, its torque F·c loads them with F·c/b each, in opposite directions: a turn rate of 4·c/b^2 times what F makes ahead.
    Where the wheels stand, the share ``at_rest`` of both.
    """
    cos, sin = np.cos(place[..., 2]), np.sin(place[..., 2])
    share = at_rest + (1.0 - at_rest) * body.moving
    moved = body.with_added("forward_m_s", share * (east_m_s * cos + north_m_s * sin))
    turn_per_m = 4.0 * ahead_share / body.wheelbase_m
    return moved.with_added("yaw_rad_s", turn_per_m * share * (north_m_s * cos - east_m_s * sin))


def guessed(wheels: Wheels, anchored: bool) -> tuple[float, ...]:
    """East and north velocity at the origin, their decrease with the distance (1/s, 0 unless ``anchored``), wheelbases ahead.

    By least squares on pieces of the trials, beside a gain of each of the two velocities; empty where too little was tracked.
    """
    if wheels.conditions.seen is None:
        return ()
    typical = float(np.median(wheels.step_s[wheels.step_s > 0]))
    k = max(round(_PIECE_S / typical), 1)
    seen = wheels.conditions.seen
    lasted = np.diff(wheels.trial_s[:, ::k], axis=1)
    moved, middle = np.diff(seen[:, ::k], axis=1), (seen[:, :-k:k] + seen[:, k::k]) / 2.0
    cos, sin = np.cos(middle[..., 2]), np.sin(middle[..., 2])
    ahead = moved[..., 0] * cos + moved[..., 1] * sin
    told, told_turn = (
        np.diff(np.cumsum(u * wheels.step_s, axis=1)[:, ::k], axis=1)
        for u in ((wheels.left_m_s + wheels.right_m_s) / 2.0, (wheels.right_m_s - wheels.left_m_s) / wheels.wheelbase_m)
    )
    good = np.isfinite(ahead) & (lasted < 3 * _PIECE_S) & (lasted > 0)
    if good.sum() < _FEWEST:
        return ()
    x, y = middle[..., 0], middle[..., 1]
    columns = [told, lasted * cos, lasted * sin] + ([-lasted * (x * cos + y * sin)] if anchored else [])
    _, east, north, *less = _solved([c[good] for c in columns], (ahead - told)[good])
    fall = less[0] if less else 0.0
    across = (north - fall * y) * cos - (east - fall * x) * sin
    _, turn_per_m = _solved([told_turn[good], (lasted * across)[good]], (moved[..., 2] - told_turn)[good])
    return east, north, fall, float(np.clip(turn_per_m * wheels.wheelbase_m / 4.0, -1.0, 1.0))


def _solved(columns: list[Array], target: Array) -> list[float]:
    found: list[float] = np.linalg.lstsq(np.stack(columns, axis=1), target, rcond=1e-9)[0].tolist()
    return found
