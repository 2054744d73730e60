"""By how much the clocks of two files differ: where the speeds driven fit those commanded best."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.signal import correlate

from bns.diagnose.data.guess.numbers import in_si
from bns.diagnose.data.mapping import FORWARD
from bns.diagnose.settings import DEFAULTS
from bns.measurements import COMMANDS

_LEAST_S = DEFAULTS.data.guess_clock_s
_STEP_S = DEFAULTS.data.guess_clock_step_s
_AGREE, _CLEARER = DEFAULTS.data.guess_clock_agree
_SHORTEST_S, _LONGEST_S = DEFAULTS.data.guess_clock_lasts_s
_HALF_S = DEFAULTS.data.guess_clock_half_s
Part = tuple[pd.DataFrame, Mapping[str, Any]]


@dataclass(frozen=True)
class Clocks:
    """``offset_s``: added to times of the commands, gives the poses' clock; ``correlation`` of the speeds there, -1 to 1."""

    offset_s: float
    correlation: float


def clocks(poses: Part, commands: Part) -> Clocks | None:
    """How two files, each a table and its entries, are joined; None where they have one clock, or where that cannot be said."""
    seen, told = _speed_of_poses(*poses), _speed_of_commands(*commands)
    if seen is None or told is None:
        return None
    (t0, driven), (t1, set_) = seen, told
    fits, shifts = _correlations(driven, set_)
    if not fits.size:
        return None
    best = int(fits.argmax())
    others = fits[np.abs(shifts - shifts[best]) * _STEP_S > _LEAST_S]
    offset = float((shifts[best] + _vertex(fits, best)) * _STEP_S + t0 - t1)
    clear = fits[best] >= _AGREE and 1.0 - others.max(initial=0.0) ** 2 >= _CLEARER * (1.0 - fits[best] ** 2)
    return Clocks(round(offset, 2), float(fits[best])) if clear and abs(offset) > _LEAST_S else None


def _speed_of_poses(table: pd.DataFrame, entries: Mapping[str, Any]) -> tuple[float, np.ndarray] | None:
    if not {"t_s", "x_m", "y_m"} <= set(entries):
        return None
    t, x, y = (_numbers(table, entries[name]) for name in ("t_s", "x_m", "y_m"))
    known = np.isfinite(t) & np.isfinite(x) & np.isfinite(y)
    grid = _grid(t[known])
    if grid is None:
        return None
    order = np.argsort(t[known], kind="stable")
    at = t[known][order]
    places = [np.interp(grid, at, values[known][order]) for values in (x, y)]
    half = max(round(_HALF_S / _STEP_S), 1)
    way = np.hypot(*(np.pad(place[2 * half :] - place[: -2 * half], half, mode="edge") for place in places))
    return float(grid[0]), way


def _speed_of_commands(table: pd.DataFrame, entries: Mapping[str, Any]) -> tuple[float, np.ndarray] | None:
    names = COMMANDS if set(COMMANDS) <= set(entries) else (FORWARD,)
    if not {"t_s", *names} <= set(entries):
        return None
    t, *speeds = (_numbers(table, entries[name]) for name in ("t_s", *names))
    forward = np.abs(np.mean(speeds, axis=0))
    known = np.isfinite(t) & np.isfinite(forward)
    grid = _grid(t[known])
    if grid is None:
        return None
    order = np.argsort(t[known], kind="stable")
    held = np.searchsorted(t[known][order], grid, side="right") - 1
    return float(grid[0]), forward[known][order][np.maximum(held, 0)]


def _numbers(table: pd.DataFrame, entry: Mapping[str, Any]) -> np.ndarray:
    if entry.get("unit") == "date":
        dates = pd.to_datetime(table[entry["from"]], utc=True, format="ISO8601", errors="coerce")
        return (dates - pd.Timestamp(0, tz="UTC")).dt.total_seconds().to_numpy(float)
    return in_si(table, entry, with_unit=True)


def _grid(t: np.ndarray) -> np.ndarray | None:
    """Times from the first to the last; None where there are too few, or so many that something else than time is in them."""
    lasts = float(np.ptp(t)) if t.size else 0.0
    return t.min() + _STEP_S * np.arange(math.floor(lasts / _STEP_S)) if _SHORTEST_S < lasts < _LONGEST_S else None


def _correlations(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Correlation of a with b shifted by so many steps, over where they overlap, at least by half of the shorter."""
    ones_a, ones_b = np.ones_like(a), np.ones_like(b)
    count = np.round(correlate(ones_a, ones_b, method="fft"))
    sums = [correlate(*pair, method="fft") for pair in ((a, ones_b), (ones_a, b), (a * a, ones_b), (ones_a, b * b), (a, b))]
    n = np.maximum(count, 1.0)
    spread = np.maximum(sums[2] - sums[0] ** 2 / n, 0.0) * np.maximum(sums[3] - sums[1] ** 2 / n, 0.0)
    least = 1e-12 * float((a * a).sum() * (b * b).sum())
    wide = (count >= min(len(a), len(b)) / 2) & (spread > least)
    fits = (sums[4] - sums[0] * sums[1] / n)[wide] / np.sqrt(spread[wide])
    return fits, np.arange(len(count))[wide] - (len(b) - 1)


def _vertex(values: np.ndarray, at: int) -> float:
    """Where a parabola through the highest value and its neighbours has its vertex, -0.5 to 0.5 steps from it."""
    if not 0 < at < len(values) - 1:
        return 0.0
    before, here, after = values[at - 1 : at + 2]
    bend = before - 2.0 * here + after
    return float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5)) if bend < 0 else 0.0
