"""What is odd about measurements, before anything is concluded from them.

Every finding names trial and row; nothing goes in silence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bns.diagnose.data.apply_mapping import repeated
from bns.diagnose.data.far_origin import refuse_far_origin
from bns.diagnose.data.odd_commands import (
    half_told,
    lost_commands,
    never_told,
    refuse_untold,
    untold_begins,
    untold_trials,
)
from bns.diagnose.data.reckoned import reckoned
from bns.diagnose.data.still_heading import refuse_still_coordinate, refuse_still_heading
from bns.diagnose.data.units import check_units
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.measurements import COLUMNS, LEFT_OUT, POSE, RUN_UP

_HELD = DEFAULTS.data.held_share
_USUAL = DEFAULTS.data.usual_gaps
_BY_CHANCE = DEFAULTS.data.gaps_by_chance
_TYPICAL = DEFAULTS.data.gaps_typical
_JUMP_M = DEFAULTS.data.jump_m
_JUMP_RAD = DEFAULTS.data.jump_rad
_JUMP_ROUNDS = DEFAULTS.data.jump_rounds
_NEAR_S = DEFAULTS.data.jump_near_s
_LARGEST = DEFAULTS.data.largest_number


@dataclass(frozen=True)
class Finding:
    """One oddity: what, in which trial ("": in none), in which row of the table (from 0), and what was done about it."""

    trial: str
    row: int
    text: str


def checked(table: pd.DataFrame) -> tuple[pd.DataFrame, list[Finding]]:
    """The rows that can be used, by their numbers in the table, and findings. DataError where going on would be guessing."""
    check_columns(table, COLUMNS)
    table = table.reset_index(drop=True)
    table["t_s"] = _in_seconds(table["t_s"])
    to_numbers(table, COLUMNS[1:])
    table.loc[left_out_rows(table), list(POSE)] = np.nan
    findings: list[Finding] = []
    odd = half_told(table)
    _held(table, findings)
    spare = _merge_rows_of_one_time(table)
    t, pose, own = table["t_s"].to_numpy(), table[list(POSE)].to_numpy(), own_rows(table)
    kept = []
    for trial, rows in rows_by_trial(table):
        at = rows[~spare[rows]]
        if not (_is_sound(t[at[own[at]]], pose[at[own[at]]]) and (np.diff(t[at]) > 0).all()):
            of_trial: list[Finding] = []
            good = _looked_through(trial, table.iloc[at], of_trial)
            findings += sorted(of_trial, key=lambda finding: finding.row)
            at = good.index.to_numpy()  # rows are numbered from 0
            pose[at] = good[list(POSE)].to_numpy()
        kept.append(at)
    chosen = np.concatenate([np.zeros(0, np.int64), *kept])
    usable = table.iloc[chosen].copy()
    usable[list(POSE)] = pose[chosen]
    begins = np.zeros(len(table), bool)
    if not _tracked(usable).any():
        raise DataError("There is no tracked pose in these measurements: every x_m, y_m or heading_rad is empty.")
    for trial, rows, text in untold_begins(usable, rows_by_trial(usable)):
        findings.append(Finding(trial, int(usable.index[rows[0]]), text))
        begins[usable.index[rows]] = True
    usable = usable[~begins[usable.index]]
    trials = rows_by_trial(usable)
    refuse_untold(usable, trials)
    refuse_still_heading(usable, trials)
    refuse_still_coordinate(usable, trials)
    note = check_units(usable, trials)
    refuse_far_origin(usable)  # of positions in mm and cm the unit is said first
    unit: tuple[int, str] | None = (int(usable.index[0]), note) if note else None
    empty = (untold_trials(usable, trials), never_told(usable), lost_commands(usable, trials))
    oddities = (unit, odd, *empty, _nameless(table), reckoned(usable, trials))
    names = table["trial"].astype(object).where(table["trial"].notna(), "")
    told = [Finding(str(names.iloc[row]), row, text) for row, text in filter(None, oddities)]
    return usable, told + findings


def _in_seconds(times: pd.Series) -> pd.Series:
    """Dates (with or without a time zone) and differences of time, as pandas has them, as seconds; all else as it is."""
    if pd.api.types.is_datetime64_any_dtype(times):
        times = times - times.min()
    return times.dt.total_seconds() if pd.api.types.is_timedelta64_dtype(times) else times


def _nameless(table: pd.DataFrame) -> tuple[int, str] | None:
    """Poses that belong to no trial, the first of them."""
    lost = np.flatnonzero(table["trial"].isna() & _tracked(table))
    if not len(lost):
        return None
    many = "1 pose belongs" if len(lost) == 1 else f"{len(lost)} poses belong"
    return int(lost[0]), f"{many} to no trial (the column trial is empty): not used; the first here"


def rows_by_trial(table: pd.DataFrame) -> list[tuple[str, np.ndarray]]:
    """Name and row numbers of each trial, trials in the order in which they come; rows without a name belong to none."""
    codes, names = pd.factorize(table["trial"])
    order = np.argsort(codes, kind="stable")[int((codes < 0).sum()) :]
    ends = np.cumsum(np.bincount(codes[codes >= 0], minlength=len(names)))
    return list(zip(map(str, names), np.split(order, ends[:-1]) if len(names) else [], strict=True))


def whole_names(trials: pd.Series) -> pd.Series:
    """Trials numbered 8 stay 8 where rows without a name have made 8.0 of them; a row without a name stays without."""
    if not pd.api.types.is_float_dtype(trials) or trials.notna().all():
        return trials
    whole = trials.notna() & (trials % 1 == 0)
    return trials.astype(object).mask(whole, trials.where(whole, 0).astype("int64").astype(object))


def own_rows(table: pd.DataFrame) -> np.ndarray:
    """Rows that are no run-up, (rows,) of bool."""
    return (table[RUN_UP] != 1).to_numpy() if RUN_UP in table.columns else np.ones(len(table), dtype=bool)


def left_out_rows(table: pd.DataFrame) -> np.ndarray:
    """Rows whose poses the user left out, (rows,) of bool."""
    if LEFT_OUT not in table.columns:
        return np.zeros(len(table), dtype=bool)
    return np.asarray(pd.to_numeric(table[LEFT_OUT], errors="coerce") > 0)


def _is_sound(t: np.ndarray, pose: np.ndarray) -> bool:
    """Whether a trial has nothing to find: what most trials are, and looking closer takes a hundred times as long."""
    steps = np.diff(t)
    if not (np.isfinite(pose).all() and (steps > 0).all()):
        return False
    if len(t) > 2 and (steps > max(5 * float(np.median(steps)), 0.2)).any():
        return False
    return len(t) < 5 or not _jumps(pose, t).any()


def _looked_through(trial: str, rows: pd.DataFrame, findings: list[Finding]) -> pd.DataFrame:
    """The rows of a trial that can be used; none, if no pose was tracked in it."""
    good = forward_in_time(trial, rows, findings)
    good = _without_jumps(trial, good, findings)
    _gaps_and_losses(trial, good[own_rows(good)], findings)
    if _tracked(good).any():
        return good
    findings.append(Finding(trial, int(rows.index[0]), "no pose was tracked; the trial is excluded"))
    return good.iloc[:0]


def _tracked(rows: pd.DataFrame) -> pd.Series[bool]:
    """Which rows hold a whole pose."""
    return rows[list(POSE)].notna().all(axis=1)


def check_columns(table: pd.DataFrame, columns: Sequence[str]) -> None:
    """DataError if one of the columns is missing, or if there are no rows."""
    twice = [name for name in columns if (table.columns == name).sum() > 1]
    if twice:
        raise DataError(f"The measurements have more than one column {', '.join(twice)}; leave out all but one of that name.")
    missing = [name for name in columns if name not in table.columns]
    if missing:
        index = [str(name) for name in table.index.names if name in missing]
        in_index = f"{' and '.join(index)} in the index (`table.reset_index()` makes columns of it), and " if index else ""
        raise DataError(
            f"The measurements lack {', '.join(missing)}; they have {in_index}"
            f"{', '.join(map(str, table.columns)) or 'no columns'}. "
            "Name the columns with `bns import` (in Python: bns.Measurements(table, mapping=...)), or write "
            + ", ".join(columns)
            + "."
        )
    if table.empty:
        raise DataError("The measurements have no rows.")


def to_numbers(table: pd.DataFrame, columns: Sequence[str]) -> None:
    """Make these columns floats, in place. DataError names the first row that holds something else, or no time."""
    for name in columns:
        values = pd.to_numeric(table[name], errors="coerce")
        wrong = np.flatnonzero(values.isna() & table[name].notna())
        wrong = wrong[(table[name].iloc[wrong].astype(str).str.lower() != "nan").to_numpy()] if len(wrong) else wrong
        if len(wrong):
            row = int(wrong[0])
            raise DataError(f"Row {row}: {name} is {table[name].iloc[row]!r}; it must be a number or empty.")
        if np.isinf(values).any():
            row = int(np.flatnonzero(np.isinf(values))[0])
            raise DataError(f"Row {row}: {name} is infinite; leave it empty where nothing was measured.")
        if (values.abs() > _LARGEST).any():
            row = int(np.flatnonzero(values.abs() > _LARGEST)[0])
            raise DataError(f"Row {row}: {name} is {values.iloc[row]:g}; no measurement is that large.")
        table[name] = values.astype(float)
    if table["t_s"].isna().any():
        row = int(np.flatnonzero(table["t_s"].isna())[0])
        raise DataError(f"Row {row}: t_s is empty; every row needs its time.")


def _held(table: pd.DataFrame, findings: list[Finding]) -> None:
    """Says so where a slow tracker's poses are repeated until the next comes: they look like a robot that moves in jerks."""
    again = repeated(table)
    if again.mean() > _HELD:
        row = int(np.flatnonzero(again)[0])
        text = (
            f"{again.mean():.0%} of all poses repeat the one before while the robot is commanded to move, the first here: is "
            "the tracker slower than the log? `repeated_poses: lost` in the mapping of `bns import` marks them as lost"
        )
        findings.append(Finding(str(table["trial"].iloc[row]), row, text))


def _merge_rows_of_one_time(table: pd.DataFrame) -> np.ndarray:
    """A pose and a command that were logged as two rows of the same time become one, the first: the later command holds.

    In place; the second rows, (rows,) of bool, have nothing more to say.
    """
    t, trial = table["t_s"].to_numpy(), pd.factorize(table["trial"])[0]
    seen = _tracked(table).to_numpy()
    first = np.flatnonzero((t[1:] == t[:-1]) & (trial[1:] == trial[:-1]) & (seen[1:] != seen[:-1]))
    first = first[np.append(True, np.diff(first) > 1)] if len(first) else first  # of three rows the first two
    spare = np.zeros(len(t), dtype=bool)
    spare[first + 1] = True
    for column in table.columns if len(first) else ():
        values = table[column].to_numpy(copy=True)
        gone = ~seen[first + 1] if column in POSE else pd.isna(values[first + 1])
        values[first] = np.where(gone, values[first], values[first + 1])
        table[column] = values
    return spare


def _without_those_ahead(trial: str, rows: pd.DataFrame, findings: list[Finding]) -> pd.DataFrame:
    """Without rows whose time lies after that of a later row, where they are fewer than the rows that lie before an earlier one.

    A single time that is wrong in this direction would cost all rows up to it.
    """
    t = rows["t_s"].to_numpy()
    ahead, behind = np.zeros((2, len(t)), dtype=bool)
    ahead[:-1] = t[:-1] > np.minimum.accumulate(t[::-1])[::-1][1:]
    behind[1:] = t[1:] < np.maximum.accumulate(t)[:-1]
    if not 0 < ahead.sum() < behind.sum():
        return rows
    found = np.flatnonzero(ahead)
    row, at_s = int(rows.index[found[0]]), f"{t[found[0]]:g} s"
    one = f"time {at_s} lies after that of later rows; the row is excluded"
    many = f"in {len(found)} rows, the first here (time {at_s}), the time lies after that of later rows; they are excluded"
    findings.append(Finding(trial, row, one if len(found) == 1 else many))
    return rows[~ahead]


def forward_in_time(trial: str, rows: pd.DataFrame, findings: list[Finding]) -> pd.DataFrame:
    """Rows later than all before them; without those that lie ahead of later rows, where these are fewer than the ones behind."""
    rows = _without_those_ahead(trial, rows, findings)
    t = rows["t_s"].to_numpy()
    latest = np.maximum.accumulate(t)
    good = np.ones(len(t), dtype=bool)
    good[1:] = t[1:] > latest[:-1]
    same = np.append(False, t[1:] == latest[:-1])
    for what, whose in (("repeats", ~good & same), ("lies before", ~good & ~same)):
        found = np.flatnonzero(whose)
        if len(found):
            row, at_s = int(rows.index[found[0]]), f"{t[found[0]]:g} s"
            one = f"time {at_s} {what} an earlier one; the row is excluded"
            many = f"in {len(found)} rows, the first here (time {at_s}), the time {what} an earlier one; they are excluded"
            findings.append(Finding(trial, row, one if len(found) == 1 else many))
    if (~good).mean() > 0.5 and len(t) > 4:
        raise DataError(
            f"Trial {trial}: time runs backwards or repeats in {(~good).sum()} of {len(t)} rows. Sort the rows by time; "
            "give each trial its own name if several were written together."
        )
    return rows[good]


def _without_jumps(trial: str, rows: pd.DataFrame, findings: list[Finding]) -> pd.DataFrame:
    """Poses far from where their neighbours put them are emptied: a marker was mistaken.

    Repeated, since jumps come in pairs too.
    """
    out = rows
    for _ in range(_JUMP_ROUNDS):
        seen = out[list(POSE)].notna().all(axis=1).to_numpy()
        if seen.sum() < 5:
            break
        pose, t = out.loc[seen, list(POSE)].to_numpy(), out.loc[seen, "t_s"].to_numpy()
        bad = out.index[seen][_jumps(pose, t)]
        if not len(bad):
            break
        findings += [
            Finding(trial, int(row), "the tracked pose jumps away and back; it counts as lost") for row in bad
        ]
        out = out.copy()
        out.loc[bad, list(POSE)] = np.nan
    return out


def _jumps(pose: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Which poses (n, 3) lie far off the line through their neighbours, more so than those do; (n,)."""
    values = np.column_stack([pose[:, :2], np.unwrap(pose[:, 2])])
    share = ((t[1:-1] - t[:-2]) / (t[2:] - t[:-2]))[:, None]
    inner = values[1:-1] - values[:-2] - share * (values[2:] - values[:-2])
    off = np.vstack([_beyond(values, t, 0, 1, 2), inner, _beyond(values, t, -1, -2, -3)])
    size = np.column_stack([np.hypot(off[:, 0], off[:, 1]), np.abs(off[:, 2])])
    span = t[2:] - t[:-2]
    near = np.concatenate([span[:1], span, span[-1:]]) < _NEAR_S
    if not near.any():
        return np.zeros(len(t), dtype=bool)
    limits = np.maximum([_JUMP_M, _JUMP_RAD], 12 * np.median(size[near], axis=0))
    times = size / limits
    times[[0, -1]] /= 2  # a line drawn beyond its ends is less certain
    excess = times.max(axis=1)
    # there and back: a pose that is held and then catches up is no jump
    across = np.hypot(*(pose[2:, :2] - pose[:-2, :2]).T)
    returns = np.concatenate([[True], across < np.maximum(size[1:-1, 0], limits[0] / 2), [True]])
    may = near & returns & (excess > 1)
    around = np.concatenate([[0.0], np.where(may, excess, 0.0), [0.0]])  # beside a jump at an end, a sound pose looks as far off
    found: np.ndarray = may & (excess >= around[:-2]) & (excess >= around[2:])
    return found


def _beyond(values: np.ndarray, t: np.ndarray, at: int, one: int, two: int) -> np.ndarray:
    """How far a pose at an end lies off the line through the next two."""
    slope = (values[one] - values[two]) / (t[one] - t[two])
    off: np.ndarray = values[at] - values[one] - slope * (t[at] - t[one])
    return off


def _gaps_and_losses(trial: str, rows: pd.DataFrame, findings: list[Finding]) -> None:
    t, left_out = rows["t_s"].to_numpy(), left_out_rows(rows)
    if len(t) > 2:
        usual = float(np.median(np.diff(t)))
        between = ~left_out[1:] & ~left_out[:-1]
        for i in map(int, np.flatnonzero((np.diff(t) > max(5 * usual, 0.2)) & between)):
            if usual < 0.2:
                findings.append(Finding(trial, int(rows.index[i]), f"no row for {t[i + 1] - t[i]:.2f} s"))
    looked_at = rows[~left_out]
    if len(looked_at):
        lost, first = poses_lost(t[~left_out], _tracked(looked_at).to_numpy())
        if lost:
            many = "1 pose lost, here" if lost == 1 else f"{lost} poses lost, the first here"
            findings.append(Finding(trial, int(looked_at.index[first]), many))


def poses_lost(t_s: np.ndarray, tracked: np.ndarray) -> tuple[int, int]:
    """How many poses of a trial are lost, and the first row that lacks one.

    Rows without a pose between two poses that follow each other as quickly as usual hold commands alone: nothing is lost there.
    ``t_s`` (rows,), ``tracked`` (rows,) of bool: does the row hold a whole pose?
    """
    if tracked.sum() < 2:
        return int((~tracked).sum()), int(np.argmin(tracked))
    lost, marks = _losses(t_s, tracked)
    return int(lost.sum()), int(marks[np.argmax(lost > 0)] + 1)


def rows_of_losses(t_s: np.ndarray, tracked: np.ndarray) -> np.ndarray:
    """Rows (rows,) without a pose, of stretches in which poses are lost; arguments as of `poses_lost`."""
    if tracked.sum() < 2:
        return ~tracked
    lost, _ = _losses(t_s, tracked)
    return np.asarray(~tracked & (lost > 0)[np.cumsum(tracked)])


def _losses(t_s: np.ndarray, tracked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Between one pose and the next (poses + 1,): how many are lost; and the rows of the poses, -1 and the end around them.

    A tracker that comes at uneven times leaves long gaps too: those without a row between their poses show how long. Where rows
    of commands alone lie in gaps that are no longer, the first and the last row of a trial may be such a row as well.
    """
    at = np.flatnonzero(tracked)
    gaps, between = np.diff(t_s[at]), np.diff(at) - 1
    usual = float(np.median(gaps))
    longest, by_chance = _long_gaps(gaps, gaps[between == 0], np.diff(np.concatenate([t_s[:1], t_s[~tracked], t_s[-1:]])))
    marks = np.concatenate([[-1], at, [len(t_s)]])
    most = 0.501 * usual  # before the first and after the last pose one is due only where a whole interval passes
    times = np.diff(np.concatenate([[t_s[0] - most], t_s[at], [t_s[-1] + most]]))
    lacks = (np.round(times / longest) > 1) & (times > by_chance)
    due = np.where(lacks, np.maximum(np.round(times / usual) - 1, 0), 0)
    rows = np.diff(marks) - 1
    if (between[~lacks[1:-1]] > 0).any():
        rows[[0, -1]] = np.maximum(rows[[0, -1]] - 1, 0)
    return np.minimum(rows, due).astype(int), marks


def _long_gaps(gaps: np.ndarray, whole: np.ndarray, apart: np.ndarray) -> tuple[float, float]:
    """The longest gap between poses that is usual, s, and how long none is by chance, s, if long ones are exponentially rarer.

    How much rarer is seen in the upper quarter of the ``whole`` gaps, in which no row lies; a gap is whole the more rarely, the
    longer it is and the less the rows without a pose are ``apart``, and counts accordingly more. Where these are too close for
    usual ones to be whole, all ``gaps`` are looked at.
    """
    usual = float(np.median(gaps))
    apart = np.sort(apart)[::-1]
    longer = np.searchsorted(-apart, -whole)
    clear = np.concatenate([[0.0], np.cumsum(apart)])[longer] - longer * whole
    often = 1.0 / np.where(clear > 0.0, clear, apart.sum())
    body = 0.5, 0.75, _USUAL
    typical, upper, longest = np.quantile(whole, body, weights=often, method="inverted_cdf") if len(whole) else 3 * (0.0,)
    if typical < _TYPICAL * usual:
        _, upper, longest = np.quantile(gaps, body)
    fall_s = (longest - upper) / np.log(0.25 / (1.0 - _USUAL))
    rarest = max(np.log(len(gaps) * (1.0 - _USUAL) / _BY_CHANCE), 0.0)
    return max(usual, float(longest)), float(longest + fall_s * rarest)
