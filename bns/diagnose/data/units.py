"""Are lengths, times, headings and speeds in the units that a table must have? What was commanded, beside what was seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from bns.diagnose.data.degrees import look_like_degrees
from bns.diagnose.data.mapping import SIZES
from bns.diagnose.data.merge_topics import without_commands
from bns.diagnose.data.speed_units import Ways, mistake_of, speed_note
from bns.diagnose.data.unlike_axes import opposite_turns, refuse_unlike_axes
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.measurements import COMMANDS, POSE

FASTEST_M_S = DEFAULTS.data.fastest_m_s
_LONG_STEP_S = DEFAULTS.data.long_step_s
_SHORT_STEP_S = DEFAULTS.data.short_step_s
_LONGEST_TRIAL_S = DEFAULTS.data.longest_trial_s
_FINER = DEFAULTS.data.finer_units
_UNTOLD_RATIO = DEFAULTS.data.untold_ratio
_LENGTHS = {"in": "inches", "cm": "centimetres", "mm": "millimetres"}
_TIMES = {"nanoseconds": "ns", "microseconds": "us", "milliseconds": "ms"}
_WITHIN = DEFAULTS.data.unit_within
_SLOWEST = DEFAULTS.data.slowest_ratio
_ALIKE = DEFAULTS.data.in_proportion
_DEGREES_AT_LEAST = DEFAULTS.data.degrees_rad_m
_MINUTES = DEFAULTS.data.minutes_ratio
_HUNDREDTHS = DEFAULTS.data.hundredths_ratio
_BEYOND = DEFAULTS.data.lengths_beyond
_FEWEST = DEFAULTS.predict.robot_fewest
_DEGREES_BEYOND = DEFAULTS.data.degrees_beyond


def check_units(table: pd.DataFrame, trials: Sequence[tuple[str, np.ndarray]]) -> str:
    """Compare what was commanded with what was seen: units show as factors. DataError names the column and the unit.

    ``trials``: names and row numbers. A note on speeds that look like another unit, though the robot may have such a gain.
    """
    pauses = table["t_s"].diff()
    step = float(pauses[pauses > 0].median())
    if step > _LONG_STEP_S:  # before anything is done second by second
        unit = next(unit for least, unit in _FINER if step > least)
        raise DataError(_apart(step, unit))
    _check_length(table)
    ways, driven, moved, ends = _driven(table, trials)
    speed = float(np.nanmax(np.abs(table[list(COMMANDS)].to_numpy())))
    ratio = _ratio(ways[:, 0], ways[:, 1]) if len(ways) else float("nan")
    untold = without_commands(table)
    if untold > 0.5 and ratio > _UNTOLD_RATIO:
        raise DataError(
            f"In {untold:.0%} of the rows with a pose no command is in force, but the robot goes {ratio:.1f} times as far as "
            "commanded. Are the commands in separate rows? `hold_commands_s: .inf` in the mapping of `bns import` keeps "
            "each until the next."
        )
    _refuse_short_steps(step, ratio)
    in_degrees = look_like_degrees(table, np.column_stack([ways[:, 0], driven.forward_m, ways[:, 2]]), moved[1], ends)
    if not in_degrees:  # before any advice that takes the way for one length
        refuse_unlike_axes(driven.forward_m, *moved)
    _refuse_unlike_wheels(ways, driven, *moved)
    if step >= 1.0 and 1 / 3000 < ratio < 1 / 300:
        raise DataError(_apart(step, "milliseconds"))
    if speed > FASTEST_M_S:
        raise DataError(
            f"Commands of up to {speed:g} m/s: left_m_s and right_m_s look like mm/s or a device's units; they must be metres "
            f"per second. {_cure('left_m_s', 'mm/s')} For a device's units, give scale: METRES_PER_SECOND (of one unit)."
        )
    if _turns_as_degrees(table) and _MINUTES[0] < _speed_ratio(table) < _MINUTES[1]:
        raise DataError(
            "The robot drives and turns about sixty times as fast as commanded: t_s looks like minutes; it must be seconds. In a "
            "mapping of `bns import`, give scale: 60 (or the same for the speeds, if they were divided by 60)."
        )
    if SIZES["mm"] / _BEYOND[1] < 1 / max(ratio, 1e-9) < SIZES["in"] * _BEYOND[0]:
        unit, name = min(_LENGTHS.items(), key=lambda one: abs(np.log(SIZES[one[0]] * ratio)))
        slow = mistake_of(1 / SIZES[unit], _WITHIN)
        if slow is not None and _turns_as_degrees(table) and table["heading_rad"].abs().max() < _DEGREES_BEYOND:
            raise DataError(f"The robot went {ratio:.0f} times as far as commanded, and turns as much further: {slow}")
        raise DataError(
            f"The robot went {ratio:.0f} times as far as commanded: x_m and y_m look like {name}; they must be metres. "
            f"{_cure('x_m', unit)}{_by_turns(ways, driven)}"
        )
    if 0 < ratio < _SLOWEST and _correlation(ways[:, 0], ways[:, 1]) > _ALIKE:
        hundredths = _HUNDREDTHS[0] < ratio < _HUNDREDTHS[1]
        inches = 1 / _WITHIN < ratio / SIZES["in/s"] < _WITHIN
        turns = f"rad/s of wheels with a radius of {1e3 * ratio:.0f} mm,{' in/s,' if inches else ''} or a device's units"
        other = mistake_of(driven.ratio)
        looks = "cm/s" if hundredths else turns
        cure = "unit: cm/s" if hundredths else "scale: METRES (a radius)" + (" or unit: in/s" if inches else "")
        if other is not None and not (hundredths or inches):
            looks, cure = f"{other.looks}, {looks}", f"{cure}, or {other.cure}"
        raise DataError(
            f"The robot went {ratio:.2g} times as far as commanded, in proportion: left_m_s and right_m_s look like {looks}; "
            "they must be metres per second. In a mapping of `bns import`, give "
            f"{cure}.{_by_turns(ways, driven)}"
        )
    if in_degrees or _turns_as_degrees(table):
        raise DataError(
            "Headings change far more than wheels can turn the robot, or than its path does: heading_rad looks like degrees; "
            f"it must be radians. {_cure('heading_rad', 'deg')}"
        )
    _refuse_opposite_turns(ways, driven, *moved)
    return speed_note(driven)


def _refuse_opposite_turns(ways: np.ndarray, driven: Ways, halfway_rad: np.ndarray, moved_m: np.ndarray) -> None:
    """DataError if the robot turns to one side where its wheels are told to turn it to the other."""
    if len(ways) and np.abs(ways[:, 2]).sum() > 0.3:
        told, seen = ways[
            np.abs(ways[:, 2]) <= np.median(np.abs(ways[ways[:, 2] != 0, 2])), 2:
        ].T  # larger ones may be rounds
        same = float(told @ seen / np.sqrt((told @ told) * (seen @ seen) + 1e-300))
        if same < -0.5:
            raise DataError(opposite_turns(driven.forward_m, halfway_rad, moved_m))


def _by_turns(ways: np.ndarray, driven: Ways) -> str:
    """What tells speeds in another unit from positions in another one: the wheelbase that the turns fit; "" if none did."""
    (ratios, _), (told, seen) = driven.ratios, np.abs(ways[:, 2:]).T
    small = (told > 0) & (seen > 0) & (seen < np.pi / 2)
    if min(small.sum(), len(ratios)) < _FEWEST:
        return ""
    ratio = float(np.median(ratios))
    base_m = float(told[small].sum() / seen[small].sum())
    return (
        f" The turns decide: if the wheels are about {base_m:.2g} m apart, the speeds are right, and x_m and y_m are not (they "
        f"are {ratio:.2g} times what they must be); if about {base_m * ratio:.2g} m, the speeds are not."
    )


def _refuse_unlike_wheels(ways: np.ndarray, driven: Ways, halfway_rad: np.ndarray, moved_m: np.ndarray) -> None:
    """DataError if one wheel takes the robot many times as far as the other one does: their columns are in different units."""
    half = np.abs(driven.turned_rad) / 2
    small = half < np.pi / 4
    left, right = driven.forward_m - ways[:, 2] / 2, driven.forward_m + ways[:, 2] / 2
    ahead = (moved_m[:, 0] * np.cos(halfway_rad) + moved_m[:, 1] * np.sin(halfway_rad)) / np.sinc(half / np.pi)
    told = np.column_stack([left, right])[small]
    if small.sum() < _FEWEST or np.linalg.matrix_rank(told) < 2:
        return
    of_left, of_right = np.linalg.lstsq(told, ahead[small], rcond=None)[0]
    alike = told.sum(axis=1)
    off = ahead[small] - alike * float(alike @ ahead[small] / max(alike @ alike, 1e-300))
    left_off = ahead[small] - told @ [of_left, of_right]
    if of_left <= 0 or of_right <= 0 or left_off @ left_off > (1.0 - _ALIKE) * (off @ off):
        return
    ratio = float(of_left / of_right)
    if max(ratio, 1 / ratio) > 1 / _SLOWEST and mistake_of(ratio, _WITHIN) is not None:
        most, least = ("left", "right") if ratio > 1 else ("right", "left")
        raise DataError(
            f"For each metre commanded, the {most} wheel takes the robot {max(ratio, 1 / ratio):.2g} times as far as the {least} "
            "one: left_m_s and right_m_s are not in the same unit. In the mapping LOG.import.yaml (`bns import`), give both the "
            "same `unit` and `scale`."
        )


def _refuse_short_steps(step_s: float, ratio: float) -> None:
    """DataError if rows are nearer to one another than any tracker's, and the robot goes ``ratio`` times as far, too far."""
    if step_s < _SHORT_STEP_S and ratio > 1 / _SLOWEST:
        raise DataError(
            f"Successive rows are {step_s:.2g} s apart, and the robot goes {ratio:.0f} times as far in them as commanded: t_s "
            "looks like milliseconds that were taken for microseconds, or seconds for milliseconds; it must be seconds. In the "
            "mapping LOG.import.yaml (`bns import`), give t_s the unit that its column has."
        )


def _apart(step_s: float, unit: str) -> str:
    """What is wrong with times of which successive ones are so far apart."""
    return f"Successive rows are {step_s:g} s apart: t_s looks like {unit}; it must be seconds. {_cure('t_s', _TIMES[unit])}"


def unit_by_ratio(ratio: float) -> str:
    """Which unit a robot means that goes ``ratio`` times as far as commanded, and how a mapping says so; "" if none fits.

    Ways that are too long look like lengths in another unit, not like speeds, unless they are by a factor of speeds alone.
    """
    lengths = {1 / SIZES[unit]: (unit, name) for unit, name in _LENGTHS.items()}
    nearest = min(lengths, key=lambda size: abs(np.log(size / ratio)))
    if 1 / _WITHIN < nearest / ratio < _WITHIN:
        unit, name = lengths[nearest]
        return f"x_m and y_m look like {name}. {_cure('x_m', unit)}"
    return str(mistake_of(ratio, _WITHIN) or "")


def _cure(column: str, unit: str) -> str:
    """How a mapping says so."""
    both = {"x_m": " and y_m", "left_m_s": " and right_m_s"}.get(column, "")
    return f"In the mapping LOG.import.yaml (`bns import`), give {column}{both} `{{from: COLUMN, unit: {unit}}}`."


def _check_length(table: pd.DataFrame) -> None:
    times = table.groupby("trial", sort=False)["t_s"]
    lasted = times.max() - times.min()
    if lasted.max() > _LONGEST_TRIAL_S:
        raise DataError(
            f"Trial {lasted.idxmax()} lasts {lasted.max():g} s, from its first t_s to its last; {_LONGEST_TRIAL_S:g} s are "
            "allowed. Is one of its times wrong?"
        )


def _turns_as_degrees(table: pd.DataFrame) -> bool:
    """Typical change of heading from row to row over that of the wheels' way: one over the wheelbase, in radians."""
    commanded = (table[COMMANDS[1]] - table[COMMANDS[0]]).shift() * _spans(table)
    return _typical(commanded.abs(), table["heading_rad"].diff().abs()) > _DEGREES_AT_LEAST


def _speed_ratio(table: pd.DataFrame) -> float:
    """Typical distance from row to row over the one commanded."""
    commanded = (table[COMMANDS[0]] + table[COMMANDS[1]]).shift() / 2 * _spans(table)
    return _typical(commanded.abs(), pd.Series(np.hypot(table["x_m"].diff(), table["y_m"].diff()), table.index))


def _spans(table: pd.DataFrame) -> pd.Series[float]:
    """Time since the row before, s; none at the first row of a trial."""
    return table["t_s"].diff().where(table["trial"].eq(table["trial"].shift()))


def _typical(commanded: pd.Series[float], seen: pd.Series[float]) -> float:
    """Median of seen over commanded, where much was commanded."""
    wide = commanded > commanded[commanded > 0].quantile(0.5)
    return float((seen[wide] / commanded[wide]).median())


def _ratio(commanded: np.ndarray, seen: np.ndarray) -> float:
    return float(seen.sum() / commanded.sum()) if commanded.sum() > 0 else float("nan")


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Of two series; 0 where one of them never changes."""
    return float(np.corrcoef(one, other)[0, 1]) if one.std() > 0 and other.std() > 0 else 0.0


def _driven(
    table: pd.DataFrame, trials: Sequence[tuple[str, np.ndarray]]
) -> tuple[np.ndarray, Ways, tuple[np.ndarray, np.ndarray], np.ndarray]:
    """For windows of about a second (windows, 4): way and turn commanded (base of 1 m), way and turn seen; the same as ways; and
    the heading halfway with the motion along x and y (windows, 2); and the headings at both ends, as logged (windows, 2).

    A trial that is shorter than that, such as a single motion of a sensor, is a window.
    """
    times, commands, poses = table["t_s"].to_numpy(), table[list(COMMANDS)].to_numpy(), table[list(POSE)].to_numpy()
    found = [np.zeros((0, 11))]
    for number, (_, at) in enumerate(trials):
        t, pose = times[at], poses[at]
        left, right = np.nan_to_num(commands[at]).T
        span = np.append(np.diff(t), 0.0)
        forward = np.concatenate([[0], np.cumsum(((left + right) / 2 * span)[:-1])])
        way = np.concatenate([[0], np.cumsum((np.abs(left + right) / 2 * span)[:-1])])
        turn = np.concatenate([[0], np.cumsum(((right - left) * span)[:-1])])
        seen = np.flatnonzero(np.isfinite(pose).all(axis=1))
        if not len(seen):
            continue
        marks = seen[np.unique(np.searchsorted(t[seen], np.arange(t[0], t[-1] + 1e-9, 1.0)).clip(max=len(seen) - 1))]
        marks = seen[[0, -1]] if len(marks) < 2 and len(seen) > 1 else marks
        heading = np.zeros(len(t))
        heading[seen] = np.unwrap(pose[seen, 2])
        a, b = marks[:-1], marks[1:]
        moved = pose[b, :2] - pose[a, :2]
        went = np.hypot(*moved.T)
        told = [way[b] - way[a], went, turn[b] - turn[a], heading[b] - heading[a], forward[b] - forward[a]]
        seen_there = [(heading[a] + heading[b]) / 2, moved, pose[a, 2], pose[b, 2]]
        found.append(np.column_stack([*told, np.full(len(a), number), *seen_there]))
    windows = np.concatenate(found)
    way, went, _, turned, forward, trial, halfway, *_ = windows.T
    ways = Ways(forward, way, went, turned, trial.astype(np.int64))
    return windows[:, :4], ways, (halfway, windows[:, 7:9]), windows[:, 9:]
