"""Headings from quaternions, in the order x, y, z, w: the scalar is last."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError

_UPRIGHT_RAD = DEFAULTS.data.upright_rad


def yaw(values: pd.DataFrame, up: str) -> pd.Series:
    """Where the body's x axis points, seen from above, by quaternions (x, y, z, w) of any length.

    ``up`` y, as motion capture often has it: counter-clockwise from x in the plane of x and -z. DataError if the body that they
    mean is not upright.
    """
    numbers = values.to_numpy(dtype=float)
    _check_upright(numbers, list(map(str, values.columns)), up)
    x, y, z, w = numbers.T
    ahead, left = w * w + x * x - y * y - z * z, 2 * (x * y + w * z) if up == "z" else 2 * (w * y - x * z)
    none = (ahead == 0) & (left == 0)
    return pd.Series(np.where(none, np.nan, np.arctan2(left, ahead)), index=values.index)


def y_is_up(numbers: np.ndarray) -> bool:
    """Whether bodies with these quaternions (n, 4) are upright if the tracker's y axis points up, and less so if z does."""
    return _tilt_rad(numbers, "y") <= min(_UPRIGHT_RAD, _tilt_rad(numbers, "z"))


def _check_upright(numbers: np.ndarray, names: list[str], up: str) -> None:
    """DataError if the axis of the body that should point up does not, in the median; it says how it would."""
    tilt = _tilt_rad(numbers, up)
    if not tilt > _UPRIGHT_RAD:  # or there is no quaternion
        return
    other = "y" if up == "z" else "z"
    if _tilt_rad(numbers[:, [1, 2, 3, 0]], up) <= _UPRIGHT_RAD:
        cure = f"They seem to have w first: from: [{', '.join([*names[1:], names[0]])}]."
    elif _tilt_rad(numbers, other) <= _UPRIGHT_RAD:
        cure = f"The tracker's {other} axis seems to point up: up: {other}."
    else:
        cure = "Check the order; if it is right, define the body in the tracker anew while the robot stands level."
    raise DataError(
        f"heading_rad is taken from the quaternions {', '.join(names)}, by which the {up} axis of the robot is "
        f"{np.degrees(tilt):.0f} degrees off up (median): a robot on a floor is upright, within {np.degrees(_UPRIGHT_RAD):.0f} "
        f"degrees. The order must be x, y, z, w. {cure}"
    )


def _tilt_rad(numbers: np.ndarray, up: str) -> float:
    """Median angle between up and the axis of the body that should point there; NaN without quaternions (n, 4)."""
    x, y, z, w = numbers.T
    size = (numbers**2).sum(axis=1)
    known = np.isfinite(size) & (size > 0)
    if not known.any():
        return float("nan")
    upwards = w * w + z * z - x * x - y * y if up == "z" else w * w + y * y - x * x - z * z
    return float(np.median(np.arccos(np.clip(upwards[known] / size[known], -1.0, 1.0))))
