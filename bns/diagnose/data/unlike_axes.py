"""Is one of x_m and y_m in another unit than the other? A robot goes as far along one as along the other, headings considered."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.mapping import SIZES
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError

Array = NDArray[np.float64]
_WITHIN = DEFAULTS.data.unit_within
_FEWEST = DEFAULTS.predict.robot_fewest
_LENGTHS = ("m", "in", "cm", "mm")


def refuse_unlike_axes(forward: Array, heading: Array, moved: Array) -> None:
    """DataError that names the axes and says how a mapping is put right; too little driven to tell is no error.

    ``forward`` (windows,), m: commanded; ``heading`` (windows,), rad: in the middle of each; ``moved`` (windows, 2): along x, y.

    What is seen is fitted by a matrix times the way ahead. A rotated or a mirrored frame, and a common factor, leave the lengths
    of its rows the same; different units of x and y do not.
    """
    matrix = seen_by_ahead(forward, heading, moved)
    if matrix is None:
        return
    rows = np.hypot(*matrix)
    larger = int(np.argmax(rows))
    times = float(rows[larger] / rows[1 - larger])
    if times < 2.0:  # inches and centimetres, the closest of all, differ by 2.54
        return
    one, other = ("x_m", "y_m")[larger], ("x_m", "y_m")[1 - larger]
    raise DataError(
        f"Along {one} the robot goes {times:.2g} times as far as along {other}, compared with its headings: the two are in "
        f"different units{_named(times)}. In the mapping LOG.import.yaml (`bns import`), give {one} and {other} the same `unit` "
        "and `scale`."
    )


def seen_by_ahead(forward: Array, heading: Array, moved: Array) -> Array | None:
    """The matrix (2, 2) by which the way ahead becomes the motion that is seen; arguments as of `refuse_unlike_axes`.

    A rotation where headings and positions belong together, with a negative determinant where one of them is mirrored. None where
    ways are too few, in nearly one direction, or not described by it.
    """
    ahead = forward[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    usable = np.isfinite(ahead).all(axis=1) & np.isfinite(moved).all(axis=1)
    ahead, moved = ahead[usable], moved[usable]
    # Ways in nearly one direction leave the matrix open: the headings may be those of another frame.
    if len(ahead) < _FEWEST or not ahead.any() or np.linalg.cond(ahead) > 5.0:
        return None
    matrix = np.linalg.lstsq(ahead, moved, rcond=None)[0]
    left, whole = ((moved - ahead @ matrix) ** 2).sum(axis=0), (moved**2).sum(axis=0)
    return None if not np.hypot(*matrix).all() or (left > 0.2 * whole).any() else np.asarray(matrix)


def opposite_turns(forward: Array, heading: Array, moved: Array) -> str:
    """Why a robot turns opposite to its wheels, and what to do; arguments as of `refuse_unlike_axes`."""
    matrix = seen_by_ahead(forward, heading, moved)
    begun = "The robot turns opposite to the wheels"
    if matrix is None:
        return (
            f"{begun}: heading_rad must run counter-clockwise (in the mapping of `bns import`, give clockwise: true), or "
            "left_m_s and right_m_s are exchanged, or the signs of both wheels are reversed (give both scale: -1)."
        )
    if np.linalg.det(matrix) < 0.0:
        return (
            f"{begun}, and its path bends the way of the wheels, not of its headings: heading_rad must run counter-clockwise. In "
            "the mapping of `bns import`, give it clockwise: true."
        )
    if np.trace(matrix) < 0.0:
        return (
            f"{begun}, and moves opposite to its heading: the signs of both wheels are reversed. In the mapping of `bns import`, "
            "give left_m_s and right_m_s scale: -1. (If instead the marker points backwards, these two are exchanged.)"
        )
    return (
        f"{begun}, and its path bends as its headings do: left_m_s and right_m_s are exchanged. In the mapping of `bns import`, "
        "exchange their columns. (Or positions and headings are both mirrored, as in a picture whose y points down: then give "
        "y_m scale: -1 and heading_rad clockwise: true instead. Turn the robot to its left by hand: heading_rad must grow.)"
    )


def _named(times: float) -> str:
    """A pair of units that differ by such a factor."""
    pairs = [(SIZES[a] / SIZES[b], a, b) for a, b in combinations(_LENGTHS, 2)]
    size, a, b = min(pairs, key=lambda one: abs(np.log(one[0] / times)))
    return f", as {a} and {b} are" if 1 / _WITHIN < size / times < _WITHIN else ""
