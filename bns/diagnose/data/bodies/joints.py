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
from bns.errors import DataError

SET = "_set_rad"
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
    east = (str(c).removesuffix(X) for c in table.columns if str(c).endswith(X))
    sites = tuple(name for name in east if name + Y in table.columns)
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
