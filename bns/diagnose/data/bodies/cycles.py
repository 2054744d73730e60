"""Measurements of a robot that is driven in cycles: checked, and as tracks with two frames a cycle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bns.diagnose.data.checks import Finding, check_columns, forward_in_time, left_out_rows, to_numbers
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.robots.snake.table import COLUMNS, GAIT, MARKERS

_LARGEST_RAD = DEFAULTS.data.cycle_largest_rad
_LONGEST_M = DEFAULTS.data.cycle_longest_m
_STRETCHED_M = DEFAULTS.data.cycle_stretched_m
_FEW = DEFAULTS.predict.fewest_cycles
_LEAST_NOISE_M = DEFAULTS.predict.marker_least_m


@dataclass(frozen=True, kw_only=True)
class CycleTracks(Tracks):
    """Frames in pairs, at the begin and at the end of every cycle; no wheels, so no speeds.

    ``pose``: the middle between the markers, and the direction from yellow to green. ``markers_m`` (frames, 2, 2): yellow and
    green, x and y. ``gait`` (cycles, 4): A_lat, A_vert, ω, α, rad. ``stable`` (cycles,). ``number`` (cycles,) in its trial.
    """

    markers_m: Array
    gait: Array
    stable: NDArray[np.bool_]
    number: NDArray[np.int64]
    between: tuple[tuple[Array, Array], ...] = ()
    """Of each cycle, what a camera saw between its begin and its end: times since its begin (n,), s, and markers (n, 2, 2)."""

    @property
    def gap_m(self) -> Array:
        """Distance of the markers, (frames,)."""
        line = self.markers_m[:, 1] - self.markers_m[:, 0]
        return np.asarray(np.hypot(line[:, 0], line[:, 1]), dtype=np.float64)


def marker_noise_m(tracks: CycleTracks) -> float | None:
    """Noise of one marker's coordinate; None where there are too few.

    A stable cycle ends in the posture in which it began, so what the markers' distance differs by is the camera's.
    """
    differ = np.abs(tracks.gap_m[1::2] - tracks.gap_m[::2])[tracks.stable]
    if len(differ) < _FEW:
        return None
    # robust: the median of a normal difference is 0.674 of its sd, which is twice that of one marker's coordinate
    return max(float(np.median(differ)) / 0.674 / 2, _LEAST_NOISE_M)


def are_cycles(table: pd.DataFrame) -> bool:
    """Whether a table means to hold cycles and markers, rather than wheel speeds and poses."""
    return "cycle" in table.columns or bool({*MARKERS} & {*table.columns})


def checked_cycles(table: pd.DataFrame) -> tuple[pd.DataFrame, list[Finding]]:
    """One row a cycle that was seen whole, and what was odd. DataError where going on would be guessing."""
    check_columns(table, COLUMNS)
    table = table.reset_index(drop=True)
    if table["stable"].dtype == object:  # true, false and empty
        table["stable"] = table["stable"].replace({True: 1.0, False: 0.0})
    to_numbers(table, COLUMNS[1:])
    _units(table)
    findings: list[Finding] = []
    found = []
    for trial, rows in table.groupby("trial", sort=False):
        good = forward_in_time(str(trial), rows, findings)
        for number in sorted(good["cycle"].dropna().astype(int).unique()):
            rows_of = good[good["cycle"] == number]
            row = None if left_out_rows(rows_of).any() else _cycle(str(trial), number, rows_of, findings)
            if row is not None:
                found.append({"trial": trial, "cycle": number, **row})
    if not found:
        raise DataError(
            "There is no complete cycle in these measurements: each needs its markers at its beginning and its end."
        )
    return pd.DataFrame(found), findings


def cycle_tracks(cycles: pd.DataFrame) -> CycleTracks:
    """The arrays of cycles that have passed the checks, trials in the order in which they come."""
    groups = [rows for _, rows in cycles.groupby("trial", sort=False)]
    cycles = pd.concat(groups)
    counts = np.array([2 * len(rows) for rows in groups])
    markers = np.array([[row.before_m, row.after_m] for row in cycles.itertuples()]).reshape(-1, 2, 2)
    t_s = cycles[["begin_s", "end_s"]].to_numpy(float).ravel()
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    line, start_s = markers[:, 1] - markers[:, 0], t_s[first[:-1]]
    heading = np.arctan2(line[:, 1], line[:, 0])
    t_s = t_s - np.repeat(start_s, counts)
    nothing = np.zeros((len(groups), 0))
    return CycleTracks(
        names=tuple(str(rows["trial"].iloc[0]) for rows in groups),
        first=first,
        t_s=t_s,
        pose=np.column_stack([markers.mean(axis=1), heading]),
        left_m_s=nothing,
        right_m_s=nothing,
        duration_s=nothing,
        start_s=start_s,
        start_known=False,
        markers_m=markers,
        gait=np.array(cycles["gait"].tolist()),
        stable=cycles["stable"].to_numpy(bool),
        number=cycles["cycle"].to_numpy(np.int64),
        between=tuple(cycles["between"]),
    )


def _cycle(trial: str, number: int, rows: pd.DataFrame, findings: list[Finding]) -> dict[str, object] | None:
    """Begin, end, parameters and stability of one cycle; None, and a finding, where something of it is missing."""
    row = int(rows.index[0])
    begin, end = rows.iloc[0], rows.iloc[-1]
    said = rows["stable"].dropna()
    reason = ""
    if len(rows) < 2:
        reason = "one row only"
    elif begin[list(GAIT)].isna().any():
        reason = "no parameters in its first row"
    elif begin[list(MARKERS)].isna().any() or end[list(MARKERS)].isna().any():
        reason = "a marker lost at its begin or end"
    elif said.empty:
        reason = "it is not known whether it was stable"
    if reason:
        findings.append(Finding(trial, row, f"cycle {number}: {reason}; left out"))
        return None
    before, after = (one[list(MARKERS)].to_numpy(float).reshape(2, 2) for one in (begin, end))
    stretched = float(np.hypot(*(after[1] - after[0])) - np.hypot(*(before[1] - before[0])))
    if said.min() > 0 and abs(stretched) > _STRETCHED_M:
        findings.append(
            Finding(
                trial,
                row,
                f"cycle {number}: the distance of the markers changes by {100 * stretched:+.0f} cm; was a marker mistaken?",
            )
        )
    inner = rows.iloc[1:-1].dropna(subset=list(MARKERS))
    return {
        "between": (
            inner["t_s"].to_numpy(float) - float(begin["t_s"]),
            inner[list(MARKERS)].to_numpy(float).reshape(-1, 2, 2),
        ),
        "begin_s": begin["t_s"],
        "end_s": end["t_s"],
        "gait": begin[list(GAIT)].to_numpy(float),
        "before_m": before,
        "after_m": after,
        "stable": bool(said.min() > 0),
    }


def _units(table: pd.DataFrame) -> None:
    gait = table[list(GAIT)].to_numpy(float)
    if not np.isfinite(table[list(MARKERS)].to_numpy(float)).all(axis=1).any():
        raise DataError("There is no row with both markers in these measurements.")
    if np.nanmax(np.abs(gait), initial=0.0) > _LARGEST_RAD:
        raise DataError(
            f"A cycle's parameter is {np.nanmax(np.abs(gait)):g}; {', '.join(GAIT)} look like degrees: they must be in radians."
        )
    wrong = np.flatnonzero((gait[:, 1] > gait[:, 0] + 1e-6) | (gait[:, :2] < 0).any(axis=1))
    if len(wrong):
        raise DataError(
            f"Row {wrong[0]}: the amplitudes are {gait[wrong[0], 0]:g} and {gait[wrong[0], 1]:g} rad; allowed is "
            "0 <= a_vert_rad <= a_lat_rad. Are the columns exchanged?"
        )
    odd = table["stable"].dropna()
    if not odd.isin([0.0, 1.0]).all():
        row = int(odd.index[~odd.isin([0.0, 1.0])][0])
        raise DataError(f"Row {row}: stable is {odd[row]:g}; it must be 1, 0 or empty.")
    seen = table[list(MARKERS)].to_numpy(float)
    apart = float(np.nanmedian(np.hypot(seen[:, 2] - seen[:, 0], seen[:, 3] - seen[:, 1])))
    if apart > _LONGEST_M:
        raise DataError(
            f"The markers are {apart:g} apart: their coordinates look like centimetres or millimetres, not metres."
        )
