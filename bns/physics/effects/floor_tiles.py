"""Joints of square tiles: two rows of parallel joints across one another, with one spacing, at each of which a wheel loses way.

One row alone is `floor-joints`; that is this effect where the joints of the second row cost nothing.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.floor_joints import EFFECT as ROW
from bns.physics.effects.floor_joints import losing, lost_by
from bns.physics.figures import figures
from bns.physics.signals import Body, Wheels
from bns.physics.wheels.joints import Joints, rows_of_joints

_SQUARE_RAD = 0.1


def apply(
    body: Body,
    spacing_m: float,
    across_rad: float,
    at_m: float,
    loss_m: float,
    over_m: float,
    second_at_m: float,
    second_share: float,
) -> Body:
    """As `floor-joints`, and where a wheel crosses a joint of the second row, ``second_share`` of that loss."""
    first = Joints(across_rad, spacing_m, at_m, over_m)
    second = Joints(across_rad + np.pi / 2.0, spacing_m, second_at_m, over_m)
    return losing(body, ((first, loss_m), (second, second_share * loss_m)))


def _starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    found = rows_of_joints(wheels)
    out = []
    for row, loss in found:
        for other, too in found:
            turned = (other.across_rad - row.across_rad - np.pi / 2.0) % (2.0 * np.pi)
            back = abs(turned - np.pi) < _SQUARE_RAD  # the same joints, counted from the other side
            if back or min(turned, 2.0 * np.pi - turned) < _SQUARE_RAD:
                start = row.spacing_m, row.across_rad, row.at_m, loss, row.over_m, -other.at_m if back else other.at_m
                out.append((*start, float(np.clip(too / loss, 0.0, 2.0))))
    return tuple(out)


def sized_by(values: Mapping[str, float]) -> str:
    """What a wheel loses, or gains, at a joint of either row."""
    second_mm = 1e3 * abs(values["second_share"] * values["loss_m"])
    said = f"{lost_by(values)} at each joint between tiles that are {values['spacing_m']:.3g} m wide"
    return said if 0.8 < values["second_share"] < 1.25 else f"{said} ({figures(second_mm)} mm at those of the second row)"


EFFECT = Effect(
    name="floor-tiles",
    stage="body",
    parameters=(
        *ROW.parameters,
        Parameter(
            "second_at_m",
            "m",
            -1e3,
            1e3,
            (-1.0, 1.0),
            0.0,
            "where a joint of the second row is, from the origin, a quarter turn to the left of the first direction",
            resolution=1e-3,
            jagged=True,
        ),
        Parameter(
            "second_share",
            "1",
            0.0,
            3.0,
            (0.0, 1.5),
            0.0,
            "way lost at a joint of the second row, divided by that at one of the first",
            resolution=0.02,
            reached=(0.0,),
        ),
    ),
    equation="as floor-joints, and at each joint where y·cos a - x·sin a = at2 + n·s a wheel's way is shorter by g·d",
    residuals="Each wheel loses the same way wherever it crosses the joints of a square grid on the floor, at any speed.",
    lookalikes=("floor-joints", "speed-gain", "wheelbase"),
    sentence="wheels lose way at the joints of square tiles",
    sized_by=sized_by,
    measurement="measure the tiles and where their joints lie, or lay one sheet over them and drive again",
    apply=apply,
    needs="track",
    needs_place=True,
    starts_from=_starts_from,
    extends="floor-joints",
)
