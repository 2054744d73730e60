"""Measurements in arrays: the tracked frames of all trials, and the commands that were in force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bns.diagnose.data.checks import left_out_rows, own_rows, rows_by_trial
from bns.diagnose.settings import DEFAULTS
from bns.measurements import BEFORE, COMMANDS, LEFT_OUT, POSE, RUN_UP, SESSION

_SAME_S = DEFAULTS.data.same_time_s
_AT_POSES = DEFAULTS.data.at_poses_share

Array = NDArray[np.float64]

MOST_FRAMES = DEFAULTS.data.most_frames
RUN_UP_S = DEFAULTS.data.run_up_s


@dataclass(frozen=True)
class Tracks:
    """Trials one after the other.

    ``first`` (trials + 1): where each trial's frames begin. ``t_s`` (frames,) since the trial's first row, run-up included (in
    a table with the columns `BEFORE`: `RUN_UP_S` more, and the speeds before are the first command); ``lead_s`` (trials,): how
    much of that lies before the trial itself begins; None: nothing. ``pose`` (frames, 3), all finite.
    ``left_m_s, right_m_s, duration_s`` (trials, commands): what was in force, back to back from the first row, padded with the
    command of the last row for 0 s. ``extra``: further numeric columns, (frames,) each. ``start_s`` (trials,): time of the
    session at the first row; ``start_known``: it was logged, not made up from the order of the trials.
    """

    names: tuple[str, ...]
    first: NDArray[np.int64]
    t_s: Array
    pose: Array
    left_m_s: Array
    right_m_s: Array
    duration_s: Array
    start_s: Array
    start_known: bool
    extra: Mapping[str, Array] = field(default_factory=dict)
    jumped: NDArray[np.bool_] | None = None
    """Frames (frames,) whose pose no drive leads to from the frame before (`tracker_faults`), or before which poses were left
    out; None: there are none."""

    lead_s: Array | None = None

    def __len__(self) -> int:
        return len(self.names)

    @property
    def timed(self) -> bool:
        """Are frames seen at times of their own, so that a clock can be wrong?"""
        return True

    @cached_property
    def commands_at_poses_s(self) -> float | None:
        """Typical time between poses, s, if nearly all commands begin when a pose was taken; None if they begin between poses."""
        ends = np.cumsum(self.duration_s, axis=1)
        changes = (np.diff(self.left_m_s, axis=1) != 0) | (np.diff(self.right_m_s, axis=1) != 0)
        trials = [(self.t_s[a:b], ends[k, :-1][changes[k]]) for k, (a, b) in enumerate(pairwise(self.first))]
        if not changes.any() or any(len(seen) < 2 for seen, _ in trials):
            return None
        off = [np.abs(seen[np.searchsorted(seen, told - _SAME_S).clip(max=len(seen) - 1)] - told) for seen, told in trials]
        if (np.concatenate(off) <= _SAME_S).mean() < _AT_POSES:
            return None
        return float(np.median(np.concatenate([np.diff(seen) for seen, _ in trials])))

    @cached_property
    def own_s(self) -> Array:
        """Time of every frame since its trial itself began, (frames,): what is shown to people."""
        return self.t_s if self.lead_s is None else self.t_s - self.lead_s[self.trial]

    @cached_property
    def session_s(self) -> Array:
        """Time of every frame since the session began, (frames,)."""
        return self.start_s[self.trial] + self.t_s

    @cached_property
    def trial(self) -> NDArray[np.int64]:
        """The trial of every frame, (frames,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.first))

    @cached_property
    def is_first(self) -> NDArray[np.bool_]:
        """Frames that begin a trial, or go on after a jump of the tracker or after poses that were left out; (frames,)."""
        found = np.zeros(len(self.t_s), dtype=bool)
        found[self.first[:-1]] = True
        return found if self.jumped is None else found | self.jumped

    @cached_property
    def relative(self) -> bool:
        """Are these single relative motions: two poses a trial, the first exactly zero? (One, where the motion was a fault.)"""
        frames = np.diff(self.first)
        two = len(frames) and frames.max() == 2 and np.median(frames) == 2
        return bool(two and not self.pose[self.first[:-1][frames > 0]].any())

    def only(self, chosen: NDArray[np.int64]) -> Tracks:
        """Some of the trials, in the order of ``chosen``."""
        selected = [np.arange(self.first[i], self.first[i + 1]) for i in chosen]
        return replace(
            self.at_frames(selected),
            names=tuple(self.names[i] for i in chosen),
            left_m_s=self.left_m_s[chosen],
            right_m_s=self.right_m_s[chosen],
            duration_s=self.duration_s[chosen],
            start_s=self.start_s[chosen],
            lead_s=None if self.lead_s is None else self.lead_s[chosen],
        )

    def thinned(self, every: int) -> Tracks:
        """Every so-manieth frame of each trial, its last one too; the commands stay as they are."""
        return self.at_frames(
            [
                np.unique(np.append(np.arange(a, b, every), b - 1)) if b > a else np.arange(a, b)
                for a, b in pairwise(self.first)
            ]
        )

    def at_frames(self, selected: Sequence[NDArray[np.int64]]) -> Tracks:
        """These frames, an array a trial."""
        frames = np.concatenate(selected)
        return replace(
            self,
            first=np.cumsum([0, *map(len, selected)]),
            t_s=self.t_s[frames],
            pose=self.pose[frames],
            extra={name: values[frames] for name, values in self.extra.items()},
            jumped=None if self.jumped is None else self._jumped_since(selected),
        )

    def _jumped_since(self, selected: Sequence[NDArray[np.int64]]) -> NDArray[np.bool_]:
        """Is there a jump between a taken frame and the taken one before?"""
        assert self.jumped is not None
        count = np.cumsum(self.jumped)
        return np.concatenate([np.diff(count[rows], prepend=count[rows[:1]]) > 0 for rows in selected])


def command_of_frames(tracks: Tracks, trial: int) -> NDArray[np.int64]:
    """Number of the command that was in force before each frame of a trial, (frames,); one more than the last after its end."""
    frames = slice(tracks.first[trial], tracks.first[trial + 1])
    return np.searchsorted(np.cumsum(tracks.duration_s[trial]), tracks.t_s[frames] - 1e-9)


def slimmed(tracks: Tracks) -> Tracks:
    """The tracks, thinned where they have more than `MOST_FRAMES`."""
    every = -(-len(tracks.t_s) // MOST_FRAMES)
    return tracks.thinned(every) if every > 1 else tracks


def tracks_of(table: pd.DataFrame) -> Tracks:
    """The arrays of a table of measurements that has passed the checks; trials in the order in which they come."""
    trials = rows_by_trial(table)
    rows = [at for _, at in trials]
    t, pose = table["t_s"].to_numpy(dtype=float), table[list(POSE)].to_numpy(dtype=float)
    tracked = np.isfinite(pose).all(axis=1)
    seen = np.concatenate([at[tracked[at]] for at in rows])
    run_up = RUN_UP_S if set(BEFORE) <= set(table.columns) else 0.0
    since, own = np.empty(len(t)), own_rows(table)
    for at in rows:
        since[at] = t[at] - t[at[0]] + run_up
    lead = np.array([since[at[own[at]][0]] if own[at].any() else since[at[-1]] for at in rows])
    commands = _commands(table, rows, t)
    start, known = _session(table, rows, since, lead)
    own_names = {"trial", "t_s", *COMMANDS, *POSE, *BEFORE, RUN_UP, LEFT_OUT}
    others = [name for name in table.columns if name not in own_names]
    numeric = [name for name in others if pd.api.types.is_numeric_dtype(table[name])]
    return Tracks(
        names=tuple(name for name, _ in trials),
        first=np.concatenate([[0], np.cumsum([int(tracked[at].sum()) for at in rows])]).astype(np.int64),
        t_s=since[seen],
        pose=pose[seen],
        left_m_s=_padded([c[0] for c in commands], "edge"),
        right_m_s=_padded([c[1] for c in commands], "edge"),
        duration_s=_padded([c[2] for c in commands], "constant"),
        start_s=start,
        start_known=known,
        lead_s=lead if lead.any() else None,
        extra={name: _at_poses(table[name].to_numpy(dtype=float), t, rows, tracked)[seen] for name in numeric},
        jumped=_begun_again(left_out_rows(table), rows, tracked),
    )


def _begun_again(
    left_out: NDArray[np.bool_], rows: list[NDArray[np.int64]], tracked: NDArray[np.bool_]
) -> NDArray[np.bool_] | None:
    """Frames that come after poses which were left out; None where there are none."""
    if not left_out.any():
        return None
    before = [np.cumsum(left_out[at])[tracked[at]] for at in rows]
    found = np.concatenate([np.diff(count, prepend=count[:1]) > 0 for count in before])
    return found if found.any() else None


def _at_poses(values: Array, t_s: Array, rows: list[NDArray[np.int64]], tracked: NDArray[np.bool_]) -> Array:
    """A column (rows,) that was logged in rows without poses alone, by straight lines between these; else as it is."""
    known = np.isfinite(values)
    if (known & tracked).any() or not known.any():
        return values
    out = values.copy()
    for at in rows:
        there = at[known[at]]
        if len(there):
            out[at] = np.interp(t_s[at], t_s[there], values[there])
    return out


def _commands(table: pd.DataFrame, rows: list[NDArray[np.int64]], t_s: Array) -> list[tuple[Array, Array, Array]]:
    """Runs of equal commands of each trial: left, right, duration."""
    told = np.nan_to_num(table[list(COMMANDS)].to_numpy(dtype=float))
    before = None
    if set(BEFORE) <= set(table.columns):
        before = np.nan_to_num(table[list(BEFORE)].to_numpy(dtype=float))
    found = []
    for at in rows:
        t, given = t_s[at], told[at]
        changes = np.flatnonzero(np.any(np.diff(given, axis=0) != 0, axis=1)) + 1
        begins = np.concatenate([[0], changes])
        ends = np.append(t[begins[1:]], t[-1])
        left, right, lasted = given[begins, 0], given[begins, 1], ends - t[begins]
        if before is not None:
            first = before[at[0]]
            left, right, lasted = np.append(first[0], left), np.append(first[1], right), np.append(RUN_UP_S, lasted)
        found.append((left, right, lasted))
    return found


def _padded(rows: list[Array], mode: Literal["edge", "constant"]) -> Array:
    """Rows of one length: their last value goes on, or zeros follow."""
    padded = np.zeros((len(rows), max(map(len, rows))))
    for line, row in zip(padded, rows, strict=True):
        line[: len(row)] = row
        if mode == "edge":
            line[len(row) :] = row[-1]
    return padded


def _session(
    table: pd.DataFrame, rows: list[NDArray[np.int64]], since: Array, lead: Array
) -> tuple[Array, bool]:
    """When each trial began in its session: as logged, else one trial right after the other."""
    if SESSION in table.columns and table[SESSION].notna().any():
        session = table[SESSION].to_numpy(dtype=float)
        first = [session[at] - since[at] for at in rows]
        begun = np.array([float(np.median(k)) if len(k := one[np.isfinite(one)]) else 0.0 for one in first])
        known = True
    else:
        lasted = np.array([since[at[-1]] for at in rows]) - lead
        begun, known = np.concatenate([[0.0], np.cumsum(lasted)[:-1]]) - lead, False
    return (begun - min(float(begun.min()), 0.0) if lead.any() else begun), known  # no session begins below 0
