"""A round patch of floor with another friction: the edge of a carpet, oil, dust, a strip of tape."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from itertools import product

import numpy as np

from bns.physics.effect import Parameter
from bns.physics.jointed.pieced import Piece, PiecedEffect
from bns.physics.jointed.plant import Plant, Rough

_PITCH_M, _SIDE = 0.4, 5
"""Tents stand so far apart, up to so many of them on every side of the origin: a floor of 4 m by 4 m is covered."""
_SAMPLES = 9
"""The share of a tent that a disc covers is taken over so many points a side."""
_RISE = 1.1
"""Tents are simulated at three times the friction: exp(1.1)."""
_STRAIGHT_M = 2.0
"""The rim of a larger disc is a straight line, as far as a robot can tell: it bends by 6 cm over a metre."""


def apply(plant: Plant, x_m: float, y_m: float, radius_m: float, factor: float) -> Plant:
    """Friction times ``factor`` within ``radius_m`` of the centre."""
    if factor == 1.0:
        return plant
    return replace(plant, rough=(*plant.rough, Rough(x_m, y_m, radius_m, float(np.log(factor)))))


def pieces(x_m: float, y_m: float, radius_m: float, factor: float) -> tuple[tuple[Piece, float], ...]:
    """Tents that together make the patch: each by the share of it that the patch covers."""
    shares = Rough(x_m, y_m, radius_m, 1.0).at(_points()) @ _weights()
    return tuple((tent(*at), float(np.log(factor) * share)) for at, share in zip(_PLACES, shares, strict=True) if share > _LEAST)


def _tented(plant: Plant, rise: float, x_m: float, y_m: float) -> Plant:
    return replace(plant, rough=(*plant.rough, Rough(x_m, y_m, _PITCH_M, rise, disc=False))) if rise else plant


@lru_cache(maxsize=512)
def tent(column: int, row: int) -> Piece:
    """The piece that stands there."""
    x_m, y_m = column * _PITCH_M, row * _PITCH_M

    def apply_tent(plant: Plant, rise: float) -> Plant:
        return _tented(plant, rise, x_m, y_m)

    number = Parameter("rise", "1", -5.0, 5.0, (-_RISE, _RISE), 0.0, "logarithm of the factor of the friction")
    return Piece(f"floor-tent-{column}-{row}", "mechanics", (number,), "mu' = mu * exp(rise * tent(x, y))", "", (), apply_tent)


_PLACES = tuple(product(range(-_SIDE, _SIDE + 1), repeat=2))
_LEAST = 1e-3


@lru_cache(maxsize=1)
def _points() -> np.ndarray:
    """Where the share of each tent is taken, (tents, points, 2), m."""
    side = (np.arange(_SAMPLES) + 0.5) / _SAMPLES * 2 - 1
    inner = np.array(list(product(side, repeat=2))) * _PITCH_M
    return np.array(_PLACES, dtype=np.float64)[:, None] * _PITCH_M + inner


@lru_cache(maxsize=1)
def _weights() -> np.ndarray:
    """What each of these points counts, (points,); they sum to 1."""
    side = (np.arange(_SAMPLES) + 0.5) / _SAMPLES * 2 - 1
    hat = 1 - np.abs(np.array(list(product(side, repeat=2))))
    weight: np.ndarray = hat.prod(axis=1)
    return weight / weight.sum()


def _starts() -> Iterator[tuple[float, float, float, float]]:
    """Small and larger discs all over the floor, and straight edges in eight directions."""
    side = np.arange(-1.2, 1.21, 0.4).round(2).tolist()
    discs = [(x, y, radius) for x, y in product(side, repeat=2) for radius in (0.35, 0.9)]
    edges = product(np.arange(8) * np.pi / 4, np.arange(-0.6, 0.61, 0.3) + _STRAIGHT_M)
    discs += [(float(away * np.cos(to)), float(away * np.sin(to)), 0.95 * _STRAIGHT_M) for to, away in edges]
    yield from ((*disc, factor) for disc in discs for factor in (0.5, 2.0))


EFFECT = PiecedEffect(
    name="floor-patch",
    stage="mechanics",
    parameters=(
        Parameter("x_m", "m", -5.0, 5.0, (-3.0, 3.0), 0.0, "centre of the patch, east"),
        Parameter("y_m", "m", -5.0, 5.0, (-3.0, 3.0), 0.0, "centre of the patch, north"),
        Parameter(
            "radius_m", "m", 0.1, _STRAIGHT_M, (0.1, _STRAIGHT_M), 0.5, "radius of the patch", reached=(_STRAIGHT_M,)
        ),
        Parameter("factor", "1", 0.1, 12.0, (0.25, 6.0), 1.0, "friction on the patch, as a multiple of that in the model"),
    ),
    equation="mu' = factor * mu where (x - x_m)^2 + (y - y_m)^2 < radius_m^2",
    residuals="Links that are in one area of the floor slip less, or more, whichever links these are; elsewhere cycles fit.",
    lookalikes=("link-friction", "floor-friction", "floor-slope"),
    sentence="the friction of the floor is different on one patch of it",
    measurement="drag the robot over the floor with a spring balance, on the patch and outside it",
    beside={"link-friction": "A link takes its friction along, a floor does not: turn the robot round and repeat some trials."},
    starts=tuple(_starts()),
    apply=apply,
    pieces=pieces,
)
