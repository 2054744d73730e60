"""What the sizes of numbers tell where names do not: the unit of the wheels' speeds, and from where headings are counted."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from bns.diagnose.data.mapping import FORWARD, SIZES, TURN
from bns.diagnose.settings import DEFAULTS
from bns.measurements import COMMANDS

SCALE = "SCALE_M_S"
"""Stands where the speed is that one unit of a device stands for."""
_SPEEDS = {name: SIZES[name] for name in ("m/s", "cm/s", "mm/s")}
LENGTHS = {name: SIZES[name] for name in ("cm", "mm")}
_WITHIN = DEFAULTS.data.guess_speed_within
LARGEST_M = DEFAULTS.data.guess_largest_m
_WINDOW_S = DEFAULTS.data.guess_window_s
_AGREE, _DISAGREE = DEFAULTS.data.guess_headings
_STANDING, _GAP, _LASTING = DEFAULTS.data.guess_cuts
_CLEARER, _ENOUGH = DEFAULTS.data.guess_clear_gaps


def unit_of_speeds(table: pd.DataFrame, entries: Mapping[str, Any]) -> dict[str, Any]:
    """What an entry for a speed of a wheel, or forward, lacks: a unit, a scale to be filled in, or nothing (m/s, or unknown)."""
    if any({"unit", "scale"} & set(entries[name]) for name in (*COMMANDS, FORWARD) if name in entries):
        return {}
    ratio = metres_a_unit(table, entries)
    if ratio is None:
        return {}
    unit = min(_SPEEDS, key=lambda name: abs(np.log(ratio / _SPEEDS[name])))
    within = _WITHIN[0 if unit == "m/s" else 1]
    if not 1 / within < ratio / _SPEEDS[unit] < within:
        return {"scale": SCALE}
    return {} if unit == "m/s" else {"unit": unit}


def unit_of_positions(table: pd.DataFrame, entries: Mapping[str, Any]) -> dict[str, Any]:
    """What entries for x and y lack where they have no unit: that of the poses of a robot that went 100 or 1000 times as far.

    Taken for metres, such poses make one unit of the commands 100 m/s or more: no robot's commands are that coarse.
    """
    told = [entries[name] for name in (*COMMANDS, FORWARD) if name in entries]
    if not told or any("unit" in entries.get(name, {}) for name in ("x_m", "y_m")) or any("scale" in entry for entry in told):
        return {}
    ratio = metres_a_unit(table, entries, np.inf)
    if ratio is None:
        return {}
    ratio /= SIZES[told[0].get("unit", "m/s")]
    unit = min(LENGTHS, key=lambda name: abs(np.log(ratio * LENGTHS[name])))
    return {"unit": unit} if 1 / _WITHIN[0] < ratio * LENGTHS[unit] < _WITHIN[0] else {}


def cut_into_trials(
    table: pd.DataFrame, entries: Mapping[str, Any], recorded: Iterable[tuple[pd.DataFrame, Mapping[str, Any]]] = ()
) -> dict[str, float]:
    """How to cut a log without trials: at clear gaps in time, where the robot is told to stand, at any long gap, or into pieces.

    ``table``: with the commands, ``recorded``: all files and their entries, for a gap is where none of them has a row; by default
    the table alone. Where it stands, if no column of the table says when or what it was told.
    """
    told = [name for name in (*COMMANDS, FORWARD, TURN) if name in entries]
    numbers = _columns(table, entries, ("t_s", *told)) if told else None
    if numbers is None or entries["t_s"].get("unit") == "date":
        return {"standing_s": _STANDING}
    t, *speeds = numbers
    still = np.max([np.abs(np.nan_to_num(one)) for one in speeds], axis=0) == 0.0
    turned = np.flatnonzero(np.diff(still.astype(int)))
    stands = sum(bool(still[a + 1]) and t[b] - t[a] >= _STANDING for a, b in pairwise(turned))
    between = _between_rows(list(recorded) or [(table, entries)])
    clear = _clear_gaps(between)
    if clear is not None and (between > clear).sum() >= _ENOUGH * stands:
        return {"gap_s": clear}
    if stands:
        return {"standing_s": _STANDING}
    return {"gap_s": _GAP} if between.max(initial=0.0) > _GAP else {"lasting_s": _LASTING}


def _between_rows(recorded: Iterable[tuple[pd.DataFrame, Mapping[str, Any]]]) -> np.ndarray:
    """Times (s) from each row to the next one, whatever file they are in; none where a file does not say when its rows are of."""
    known = [(table, {} if entries.get("t_s", {}).get("unit") == "date" else entries) for table, entries in recorded]
    found = [_columns(table, entries, ("t_s",)) for table, entries in known]
    times = [numbers[0] for numbers in found if numbers is not None]
    return np.diff(np.sort(np.concatenate(times))) if len(times) == len(found) else np.zeros(0)


def _clear_gaps(between: np.ndarray) -> float | None:
    """A time (s) that lies well between those from row to row of a recording and those of its gaps; None where nothing does."""
    lasts = np.sort(between[np.isfinite(between) & (between > 0)])
    wider = lasts[1:] / lasts[:-1]
    wider[lasts[1:] <= _GAP] = 0.0
    if not wider.max(initial=0.0) >= _CLEARER:
        return None
    at = int(wider.argmax())
    return _GAP if lasts[at] < _GAP else float(f"{np.sqrt(lasts[at] * lasts[at + 1]):.2g}")


def spread_of_positions(table: pd.DataFrame, entries: Mapping[str, Any]) -> float | None:
    """How far apart the positions are, as they stand in the table; None where it has none."""
    names = [entries[name]["from"] for name in ("x_m", "y_m") if name in entries]
    if len(names) < 2 or any(not isinstance(name, str) or name not in table for name in names):
        return None
    numbers = np.array([pd.to_numeric(table[name], errors="coerce").to_numpy(float) for name in names])
    seen = numbers[:, np.isfinite(numbers).all(axis=0)]
    return float(np.ptp(seen, axis=1).max()) if seen.size else None


def metres_a_unit(table: pd.DataFrame, entries: Mapping[str, Any], largest_m: float | None = None) -> float | None:
    """How far the robot went, over what the commands (of both wheels, or forward) add up to; None where that cannot be said.

    ``largest_m``: positions that spread further are not taken for metres (by default the setting).
    """
    told = COMMANDS if set(COMMANDS) <= set(entries) else (FORWARD,)
    numbers = _columns(table, entries, ("t_s", "x_m", "y_m", *told))
    if numbers is None:
        return None
    t, x, y, *speeds = numbers
    good = np.isfinite(t) & np.isfinite(x) & np.isfinite(y)
    largest_m = LARGEST_M if largest_m is None else largest_m
    if good.sum() < 3 or max(np.ptp(x[good]), np.ptp(y[good])) > largest_m:
        return None
    lasts = np.maximum(np.append(np.diff(t), 0.0), 0.0)
    way = np.concatenate([[0.0], np.cumsum(np.nan_to_num(np.abs(np.mean(speeds, axis=0))) * lasts)[:-1]])
    every = max(round(_WINDOW_S / np.median(lasts[lasts > 0])), 1) if (lasts > 0).any() else 1
    at = np.flatnonzero(good)[::every]
    a, b = at[:-1], at[1:]
    near = (t[b] > t[a]) & (t[b] - t[a] < 3.0 * _WINDOW_S)  # not from trial to trial
    went, told = np.hypot(x[b] - x[a], y[b] - y[a])[near].sum(), (way[b] - way[a])[near].sum()
    return float(went / told) if went > 0 and told > 0 else None


def heading_convention(table: pd.DataFrame, entries: Mapping[str, Any]) -> dict[str, Any]:
    """What an entry for the heading lacks: ``clockwise``, and the quarter turns of ``zero_deg``; from where the robot drove.

    Nothing where that cannot be said: with no commands that tell forwards from backwards, or on a path that hardly turns.
    """
    told = COMMANDS if set(COMMANDS) <= set(entries) else (FORWARD,)
    numbers = _columns(table, entries, ("t_s", "x_m", "y_m", "heading_rad", *told))
    if numbers is None:
        return {}
    t, x, y, heading, *speeds = numbers
    good = np.flatnonzero(np.isfinite(t) & np.isfinite(x) & np.isfinite(y) & np.isfinite(heading))
    lasts = np.diff(t[good])
    if not (lasts > 0).any():
        return {}
    driven = np.concatenate([[0.0], np.cumsum(np.nan_to_num(sum(speeds)))[:-1]])  # its sign in a window: forwards or backwards
    at = good[:: max(round(_WINDOW_S / np.median(lasts[lasts > 0])), 1)]
    a, b = at[:-1], at[1:]
    way = np.hypot(x[b] - x[a], y[b] - y[a])
    moved = (t[b] > t[a]) & (t[b] - t[a] < 3.0 * _WINDOW_S) & (driven[b] != driven[a])
    if not moved.any():
        return {}
    moved &= way >= 0.5 * np.median(way[moved])
    a, b = a[moved], b[moved]
    towards = np.arctan2(y[b] - y[a], x[b] - x[a]) + np.where(driven[b] > driven[a], 0.0, np.pi)
    middle = np.angle(np.exp(1j * heading[a]) + np.exp(1j * heading[b]))
    means = {cw: complex(np.exp(1j * (towards + (middle if cw else -middle))).mean()) for cw in (False, True)}
    clockwise = abs(means[True]) > abs(means[False])
    if abs(means[clockwise]) < _AGREE or abs(means[not clockwise]) > _DISAGREE:
        return {}
    quarters = round(float(np.angle(means[clockwise])) / (np.pi / 2)) % 4
    return ({"clockwise": True} if clockwise else {}) | ({"zero_deg": 90 * quarters} if quarters else {})


def _columns(table: pd.DataFrame, entries: Mapping[str, Any], names: tuple[str, ...]) -> list[np.ndarray] | None:
    """These columns in SI units, the commands as they are; None where one is missing or is made of several."""
    if not set(names) <= set(entries) or any(not isinstance(entries[name]["from"], str) for name in names):
        return None
    return [in_si(table, entries[name], name not in {*COMMANDS, FORWARD}) for name in names]


def in_si(table: pd.DataFrame, entry: Mapping[str, Any], with_unit: bool) -> np.ndarray:
    """An entry's column, scaled and moved as it says, in SI units or as it is; NaN where no number stands."""
    numbers = pd.to_numeric(table[entry["from"]], errors="coerce").to_numpy(float)
    scale = entry.get("scale", 1.0)
    known = 1.0 if isinstance(scale, str) else float(scale)  # a word stands where a number is to be filled in
    size = SIZES[entry["unit"]] if with_unit and "unit" in entry else 1.0
    return numbers * known * size + float(entry.get("offset", 0.0))
