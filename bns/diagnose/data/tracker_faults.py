"""Which poses a tracker got wrong, judged from the tracks and commands alone: no model has a say in it.

A pose that jumps away and back is taken as lost when a table is read (`checks`), and so are several that go away together and
come back (`excursions`). What remains are jumps that last: the tracker took another marker, or somebody moved the robot. A window
that spans one says nothing of any model.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.settings import DEFAULTS

LEAST_M = DEFAULTS.data.jump_m
LEAST_RAD = DEFAULTS.data.jump_rad
WAYS = DEFAULTS.data.fault_ways
USUAL = DEFAULTS.data.fault_usual
MOST_CUT = DEFAULTS.data.fault_most_cut
FEWEST_FRAMES = DEFAULTS.data.fault_fewest_frames
AROUND_S = DEFAULTS.data.fault_around_s
AWAY_S = DEFAULTS.data.fault_away_s


def without_faults(tracks: Tracks, found: NDArray[np.bool_] | None = None) -> Tracks:
    """The tracks without what comes after a jump in its trial: where the marker is wrong, its heading is wrong as well.

    Poses between a jump and the one that takes it back are lost, and nothing else is. Where the others would take more than
    `MOST_CUT` of all poses, jumps are the tracker's habit: they are marked (`Tracks.jumped`), and everything goes on from where
    the tracker sees the robot. ``found``: what `jumps` gave, where that is known.
    """
    found = jumps(tracks) if found is None else found
    visits = excursions(tracks, found)
    if visits:
        away, found = np.zeros(len(found), dtype=bool), lasting(found, visits)
        for begin, end in visits:
            away[begin:end] = True
        tracks = tracks.at_frames([np.flatnonzero(~away[a:b]) + a for a, b in pairwise(tracks.first)])
        found = found[~away]
    if not found.any():
        return tracks
    count = np.cumsum(found)
    since_start: NDArray[np.int64] = count - np.repeat(count[tracks.first[:-1]], np.diff(tracks.first))
    seen_before: NDArray[np.bool_] = np.asarray(since_start > 0)
    if seen_before.mean() > MOST_CUT:
        return replace(tracks, jumped=found if tracks.jumped is None else found | tracks.jumped)
    return tracks.at_frames([np.flatnonzero(~seen_before[a:b]) + a for a, b in pairwise(tracks.first)])


def jumps(tracks: Tracks) -> NDArray[np.bool_]:
    """Frames (frames,) whose pose no drive leads to from the frame before; where poses were left out, nobody asks."""
    found = np.zeros(len(tracks.t_s), dtype=bool)
    moved, turned = _changes(tracks.pose)
    inner = np.ones(len(moved), dtype=bool)
    inner[tracks.first[1:-1] - 1] = False
    usual = _usual(moved[inner], turned[inner])
    for trial, (a, b) in enumerate(pairwise(tracks.first)):
        if b - a > 1:
            found[a + 1 : b] = _of_trial(tracks, trial, slice(int(a), int(b)), usual)
    return found if tracks.jumped is None else found & ~tracks.jumped


def excursions(tracks: Tracks, found: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Frames at which a pose jumps away and, within `AWAY_S`, back to where the robot may have driven from before it, in pairs.

    That is no further from the last pose before the jump than the faster wheel drove, and turned against it by less than half of
    what the jump had turned the pose, if it had turned it at all.
    """
    out: list[tuple[int, int]] = []
    back = -1
    for begin, end in pairwise(np.flatnonzero(found).tolist()):
        trial = int(tracks.trial[begin])
        if begin == back or trial != tracks.trial[end] or tracks.t_s[end] - tracks.t_s[begin] > AWAY_S:
            continue
        away, home = (_changes(tracks.pose[[begin - 1, at]]) for at in (begin, end))
        times = tracks.t_s[begin - 1 : end + 1]
        way = float(_fastest(tracks, trial, times).max()) * float(times[-1] - times[0])
        turned_back = away[1][0] <= LEAST_RAD or home[1][0] < away[1][0] / 2
        if home[0][0] <= LEAST_M + way and turned_back:
            out.append((begin, end))
            back = end
    return out


def lasting(found: NDArray[np.bool_], visits: list[tuple[int, int]]) -> NDArray[np.bool_]:
    """The jumps (frames,) that are no part of an excursion."""
    out = found.copy()
    out[[frame for visit in visits for frame in visit]] = False
    return out


def spans_jump(tracks: Tracks, start: NDArray[np.int64], end: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Windows (windows,) from frame ``start`` to frame ``end`` with a jump on the way."""
    if tracks.jumped is None:
        return np.zeros(len(start), dtype=bool)
    count = np.concatenate([[0], np.cumsum(tracks.jumped)])
    return np.asarray(count[end + 1] > count[start + 1])


def _of_trial(tracks: Tracks, trial: int, frames: slice, usual: tuple[float, float]) -> NDArray[np.bool_]:
    """For the second frame of a trial and all after it; ``usual``: typical changes of trials too short to have their own."""
    t_s = tracks.t_s[frames]
    moved, turned = _changes(tracks.pose[frames])
    fresh = (moved > 0) | (turned > 0)
    fresh_at = np.maximum.accumulate(np.where(np.append(True, fresh), np.arange(len(t_s)), 0))
    lasted = t_s[1:] - t_s[fresh_at[:-1]]  # since the pose last changed: slow trackers repeat theirs
    nominal_s = float(np.median(lasted))
    lasted = _at_most(lasted, nominal_s)
    way = _fastest(tracks, trial, t_s)[1:] * lasted
    if len(t_s) >= FEWEST_FRAMES:
        usual = _usual(moved, turned)
    frames_long = np.maximum(lasted / nominal_s, 1.0)  # after a gap, the robot has gone on
    far = moved > np.maximum(np.maximum(LEAST_M, WAYS * way), USUAL * usual[0] * frames_long)
    return np.asarray(far | (turned > np.maximum(LEAST_RAD, USUAL * usual[1]) * frames_long))


def _at_most(lasted: Array, nominal_s: float) -> Array:
    """How long the robot may have driven between poses, s, (n,), where they were stamped ``lasted`` apart.

    A pose that was stamped late comes after a long interval and before a short one: the next pose, on time, shows what the robot
    drove in all that time. No frame is shorter than a nominal one.
    """
    late = np.append(0.0, np.maximum(lasted[:-1] - nominal_s, 0.0))
    return np.maximum(lasted + late, nominal_s)


def _changes(pose: Array) -> tuple[Array, Array]:
    """Distance (m) and turn (rad, the short way round) from each pose to the next, (n - 1,) each."""
    turned = np.abs((np.diff(pose[:, 2]) + np.pi) % (2 * np.pi) - np.pi)
    return np.hypot(*np.diff(pose[:, :2], axis=0).T), turned


def _usual(moved: Array, turned: Array) -> tuple[float, float]:
    """Medians of the changes where there is one."""
    fresh = (moved > 0) | (turned > 0)
    return (float(np.median(moved[fresh])), float(np.median(turned[fresh]))) if fresh.any() else (0.0, 0.0)


def _fastest(tracks: Tracks, trial: int, t_s: Array) -> Array:
    """The fastest wheel's commanded speed within `AROUND_S` of each time, m/s, (n,)."""
    ends = np.cumsum(tracks.duration_s[trial])
    speed = np.maximum(np.abs(tracks.left_m_s[trial]), np.abs(tracks.right_m_s[trial]))
    first = np.searchsorted(ends, t_s - AROUND_S).clip(max=len(ends) - 1)
    last = np.searchsorted(ends, t_s + AROUND_S).clip(max=len(ends) - 1)
    spans = np.column_stack([first, last + 1]).ravel()  # of each pair, reduceat gives the largest between
    return np.asarray(np.maximum.reduceat(np.append(speed, 0.0), spans)[::2])
