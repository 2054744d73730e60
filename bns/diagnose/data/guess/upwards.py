"""Which axis of a tracker points up: z, or y as motion capture often has it; x and y of the floor follow from that."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from bns.diagnose.data.quaternions import y_is_up
from bns.diagnose.settings import DEFAULTS

_FLAT = DEFAULTS.data.guess_flat


def with_up(table: pd.DataFrame, entries: Mapping[str, Any]) -> dict[str, Any]:
    """The entries of a pose, taken from the plane of x and -z, and turning about y, where the tracker's y axis points up."""
    across = _third(table, entries.get("y_m", {}).get("from"))
    if across is None or "heading_rad" not in entries or not _y_is_up(table, entries, across):
        return dict(entries)
    heading, source = entries["heading_rad"], entries["heading_rad"]["from"]
    if isinstance(source, list):
        turned = {**heading, "up": "y"}
    else:
        about = _renamed(str(source), "z", "y")
        turned = {**heading, "from": about if about in table else source}
    return {**entries, "y_m": {**entries["y_m"], "from": across, "scale": -1}, "heading_rad": turned}


def _y_is_up(table: pd.DataFrame, entries: Mapping[str, Any], third: str) -> bool:
    """By the quaternions, where there are any; else by the axis along which the robot hardly moved."""
    source = entries["heading_rad"]["from"]
    if isinstance(source, list):
        numbers = table[source].apply(pd.to_numeric, errors="coerce").to_numpy(float)
        return y_is_up(numbers)
    spreads = [_spread(table[name]) for name in (entries["y_m"]["from"], third)]
    return bool(spreads[0] < _FLAT * spreads[1])


def _spread(values: pd.Series) -> float:
    """Between the 5th and the 95th percentile; NaN without a number."""
    numbers = pd.to_numeric(values, errors="coerce").dropna()
    return float(np.diff(np.quantile(numbers, (0.05, 0.95)))[0]) if len(numbers) else float("nan")


def _third(table: pd.DataFrame, name: object) -> str | None:
    """The column of z beside this one of y."""
    third = _renamed(str(name), "y", "z")
    return third if third != name and third in table else None


def _renamed(name: str, old: str, new: str) -> str:
    """The name with its last single letter (as in ``robot.position.y [m]`` and ``robot.TY``) exchanged, capital or not."""
    found = list(re.finditer(rf"(?<![A-Za-z])([TRpqtr]?)({old}|{old.upper()})(?![A-Za-z])", name))
    if not found:
        return name
    at = found[-1].start(2)
    letter = new.upper() if name[at].isupper() else new
    return name[:at] + letter + name[at + 1 :]
