"""Positions far from the origin, as on a map (UTM): places are reckoned from there, and effects that have one are not found."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError

Array = NDArray[np.float64]
PLACE = ("x_m", "y_m")
_FARTHEST_M = DEFAULTS.data.far_m


def offsets_towards_origin(places_m: Array) -> tuple[int, int]:
    """What to add to x and y, m, so that the robot drives near the origin: round numbers; (0, 0) where it does already.

    ``places_m``: (poses, 2), NaN where none was tracked. It drives near enough within the limit, or as far off as it drives.
    """
    seen = places_m[np.isfinite(places_m).all(axis=1)]
    if not len(seen):
        return 0, 0
    low, middle, high = np.quantile(seen, (0.02, 0.5, 0.98), axis=0)
    wide_m = float(np.hypot(*(high - low)))
    if np.hypot(*middle) <= max(_FARTHEST_M, wide_m):
        return 0, 0
    x, y = (-_rounded(float(at), max(wide_m, _FARTHEST_M / 100.0)) for at in middle)
    return x, y


def _rounded(at_m: float, within_m: float) -> int:
    """The roundest whole number that lies so near: 455000 for 455003 within 10, 0 for 2."""
    step = 10 ** math.ceil(math.log10(max(abs(at_m), 10.0)))
    while step > 1 and abs(round(at_m / step) * step - at_m) > within_m:
        step //= 10
    return round(at_m / step) * step


def refuse_far_origin(table: pd.DataFrame) -> None:
    """DataError, with the entries of a mapping that move the origin, if the robot drives far from it."""
    places = table[list(PLACE)].to_numpy(dtype=float)
    moved = offsets_towards_origin(places)
    if not any(moved):
        return
    x, y = np.nanmedian(places, axis=0)
    entries = [f"{name}: {{from: {name}, offset: {by}}}" for name, by in zip(PLACE, moved, strict=True) if by]
    pandas = [f'table["{name}"] {"-" if by < 0 else "+"}= {abs(by)}' for name, by in zip(PLACE, moved, strict=True) if by]
    raise DataError(
        f"The positions lie {np.hypot(x, y):.0f} m from the origin (x_m is about {x:.0f}, y_m about {y:.0f}), as on a map (UTM). "
        f"They may lie {_FARTHEST_M:g} m from it, or as far as the robot drives: effects that have a place on the floor are "
        "sought about the origin, and would not be found. Subtract round numbers, the same from all logs of this site. "
        f"In the mapping LOG.import.yaml (`bns import`): `columns: {{{', '.join(entries)}}}` (an entry of yours keeps its "
        f"`from`, and gets the offset, too). In pandas: {'; '.join(pandas)}."
    )
