"""A heading that never changes although the robot turns, or a coordinate although it drives along it: none was measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from bns.diagnose.data.spread import moved
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.measurements import COMMANDS

_SAME_RAD = DEFAULTS.data.same_heading_rad
_TURNED_M = DEFAULTS.data.turned_for_certain_m


def refuse_still_heading(table: pd.DataFrame, trials: Sequence[tuple[str, np.ndarray]]) -> None:
    """DataError if the heading is the same in all poses of a robot that moves and is commanded to turn for certain.

    ``trials``: names and row numbers.
    """
    headings = table["heading_rad"].dropna().to_numpy(dtype=float)
    if len(headings) < 2 or np.abs(np.angle(np.exp(1j * (headings - headings[0])))).max() > _SAME_RAD:
        return
    furthest = max((_turned_m(table.iloc[rows]) for _, rows in trials), default=0.0)
    if furthest > _TURNED_M and moved(table, trials):
        raise DataError(
            f"heading_rad is {headings[0]:.6g} in all poses, although the commands turn the robot (one wheel is to drive up to "
            f"{furthest:.2g} m further than the other): it is no measured heading. It must be the direction in which the robot "
            "faces, counter-clockwise from x. Take it from another column of the tracker; from a quaternion in the order "
            "x, y, z, w."
        )


def refuse_still_coordinate(table: pd.DataFrame, trials: Sequence[tuple[str, np.ndarray]]) -> None:
    """DataError if x or y is the very same in all poses of a robot that drives along it by its commands and headings.

    ``trials``: names and row numbers.
    """
    for name, other, along in (("x_m", "y_m", np.cos), ("y_m", "x_m", np.sin)):
        values = table[name].dropna().to_numpy(dtype=float)
        if len(values) < 2 or np.ptp(values) > 0.0 or np.ptp(table[other].dropna()) < _TURNED_M:
            continue
        furthest = max((_driven_m(table.iloc[rows], along) for _, rows in trials), default=0.0)
        if furthest > _TURNED_M and moved(table, trials):
            raise DataError(
                f"{name} is {values[0]:.6g} in all poses, although {other} changes and the robot drives up to {furthest:.2g} m "
                f"along it by its commands and headings: it is no measured position. Take {name} from another column of the "
                "tracker; in a mapping, look at its scale."
            )


def _driven_m(rows: pd.DataFrame, along: Callable[[np.ndarray], np.ndarray]) -> float:
    """How far apart two places of a trial are along an axis, by commands and headings alone, m."""
    speed = rows[list(COMMANDS[:2])].fillna(0.0).to_numpy(dtype=float).mean(axis=1)
    heading = rows["heading_rad"].ffill().bfill().to_numpy(dtype=float)
    if not np.isfinite(heading).all():
        return 0.0
    way = np.cumsum(np.append(0.0, (speed * along(heading))[:-1] * np.diff(rows["t_s"].to_numpy(dtype=float))))
    return float(np.ptp(way))


def _turned_m(rows: pd.DataFrame) -> float:
    """By how much one wheel is commanded to drive further than the other between two times of a trial, m."""
    apart = (rows[COMMANDS[1]] - rows[COMMANDS[0]]).fillna(0.0).to_numpy(dtype=float)
    way = np.cumsum(np.append(0.0, apart[:-1] * np.diff(rows["t_s"].to_numpy(dtype=float))))
    return float(np.ptp(way))
