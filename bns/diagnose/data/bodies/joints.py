"""Measurements of a robot whose joints are told positions at times: checked, and as tracks of the sites that were seen.

Columns: trial, t_s (s); JOINT_set_rad, the set point in force from that row's time on, one for each servo (of a slide in metres);
SITE_x_m and SITE_y_m for each tracked site, empty in rows where it was not seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from bns.diagnose.data.checks import Finding, check_columns, forward_in_time, left_out_rows, to_numbers
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.measurements import SET

_SLOWEST_S = DEFAULTS.data.stretch_s
_BEYOND, _TURNS_RAD = DEFAULTS.data.set_point_beyond, DEFAULTS.data.set_point_turns_rad
_MOSTLY = DEFAULTS.data.set_points_in_other_units
_REACHES, _STILL = DEFAULTS.data.sites_reach, DEFAULTS.data.sites_still
X, Y = "_x_m", "_y_m"


@dataclass(frozen=True, kw_only=True)
class JointTracks(Tracks):
    """Frames in which all sites were seen. ``points_m`` (frames, sites, 2); ``rows``: of each trial all times (n,) and set points
    (n, joints), carried on where a row has none."""

    joints: tuple[str, ...]
    sites: tuple[str, ...]
    points_m: Array
    rows: tuple[tuple[Array, Array], ...]


def are_joints(table: pd.DataFrame) -> bool:
    """Whether a table means to hold set points of joints."""
    return any(str(name).endswith(SET) for name in table.columns)


def joint_tracks(table: pd.DataFrame) -> tuple[JointTracks, list[Finding]]:
    """Tracks of all trials in which the robot was seen, and what was odd. DataError where going on would be guessing."""
    joints = tuple(str(c).removesuffix(SET) for c in table.columns if str(c).endswith(SET))
    sites = tuple(name for name in _named(table, X) if name + Y in table.columns)
    half = [name + other for end, other in ((X, Y), (Y, X)) for name in _named(table, end) if name + other not in table.columns]
    if half:
        raise DataError(f"The measurements lack {', '.join(half)}: a tracked site has both of SITE{X} and SITE{Y}.")
    if not sites:
        raise DataError(f"No site was tracked: there is no pair of columns SITE{X} and SITE{Y}; add one for each tracked site.")
    numbers = ["t_s", *(name + SET for name in joints), *(name + end for name in sites for end in (X, Y))]
    check_columns(table, ["trial", *numbers])
    table = table.reset_index(drop=True)
    to_numbers(table, numbers)
    findings: list[Finding] = []
    names, times, points, rows, again = [], [], [], [], []
    for trial, given in table.groupby("trial", sort=False):
        good = forward_in_time(str(trial), given, findings)
        told = good[[name + SET for name in joints]].ffill().bfill().to_numpy(float)
        seen = good[[name + end for name in sites for end in (X, Y)]].to_numpy(float)
        left_out = left_out_rows(good)
        whole = np.isfinite(seen).all(axis=1) & ~left_out
        if np.isnan(told).any() or whole.sum() < 2:
            findings.append(Finding(str(trial), int(given.index[0]), "no set points, or too few poses; the trial is excluded"))
            continue
        t = good["t_s"].to_numpy(float)
        names.append(str(trial))
        times.append((t - t[0])[whole])
        points.append(seen[whole].reshape(-1, len(sites), 2))
        rows.append((t - t[0], told))
        again.append(np.diff(np.cumsum(left_out)[whole], prepend=0) > 0)
    if not names:
        raise DataError("No trial has set points of all joints and two rows in which all sites were seen.")
    first = np.concatenate([[0], np.cumsum([len(t) for t in times])]).astype(np.int64)
    points_m, nothing = np.concatenate(points), np.zeros((len(names), 0))
    line = points_m[:, -1] - points_m[:, 0]
    tracks = JointTracks(
        names=tuple(names),
        first=first,
        t_s=np.concatenate(times),
        pose=np.column_stack([points_m.mean(axis=1), np.arctan2(line[:, 1], line[:, 0])]),
        left_m_s=nothing,
        right_m_s=nothing,
        duration_s=nothing,
        start_s=np.zeros(len(names)),
        start_known=False,
        jumped=np.concatenate(again) if np.concatenate(again).any() else None,
        joints=joints,
        sites=sites,
        points_m=points_m,
        rows=tuple(rows),
    )
    return tracks, findings


def _named(table: pd.DataFrame, ending: str) -> list[str]:
    return [str(c).removesuffix(ending) for c in table.columns if str(c).endswith(ending)]


def check_scales(tracks: JointTracks, joints: Sequence[str], told: Array, extent_m: float | None) -> None:
    """DataError where columns look like other units, or set points were never logged.

    ``told`` (joints, 2): the range in which each servo follows; ``extent_m``: of a body that stands still at its base.
    """
    steps = np.concatenate([np.diff(t) for t, _ in tracks.rows])
    if len(steps) and np.median(steps) > _SLOWEST_S:
        raise DataError(f"Rows are {np.median(steps):g} s apart; t_s must be in seconds, and these look like milliseconds.")
    at = [tracks.joints.index(name) for name in joints]
    points = np.concatenate([values for _, values in tracks.rows])[:, at]
    spare = _BEYOND * (told[:, 1] - told[:, 0])
    beyond = ((points < told[:, 0] - spare) | (points > told[:, 1] + spare)).mean(axis=0)
    free = ~np.isfinite(told).all(axis=1)
    beyond[free] = (np.abs(points[:, free]) > _TURNS_RAD).mean(axis=0)
    for name, share, values in zip(joints, beyond, points.T, strict=True):
        if share > _MOSTLY:
            raise DataError(
                f"{name}{SET} goes from {values.min():.4g} to {values.max():.4g}, and {share:.0%} of it lies beyond what the "
                "servo follows; set points must be in radians (of a slide in metres), and these look like degrees or steps."
            )
    spread_m = float(np.ptp(tracks.points_m, axis=0).max())
    if extent_m is not None and spread_m > _REACHES * extent_m:
        raise DataError(
            f"The sites move over {spread_m:.4g} m, and the whole body measures {extent_m:.3g} m; positions must be in metres, "
            "and these look like millimetres or centimetres."
        )
    if (np.ptp(points, axis=0) == 0).all() and extent_m is not None and spread_m > _STILL * extent_m:
        raise DataError(
            f"Every set point is the same in all rows, and the sites move over {spread_m:.3g} m; log the set points that the "
            f"robot was given, in the columns JOINT{SET}."
        )


def check_names(tracks: JointTracks, joints: Sequence[str], sites: Sequence[str]) -> None:
    """DataError unless every servo and every tracked site of a model has its columns."""
    for kind, wanted, there, ending in (("servo", joints, tracks.joints, SET), ("tracked site", sites, tracks.sites, X)):
        missing = [name for name in wanted if name not in there]
        if missing:
            raise DataError(
                f"The measurements lack {', '.join(name + ending for name in missing)}: the model has the {kind} {missing[0]}. "
                f"They have {', '.join(name + ending for name in there)}."
                + (" Name the sites that were tracked: sites: [...] in a model file." if ending == X else "")
            )
