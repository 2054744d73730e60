"""Tracks of a robot on joints as stretches, each simulated by itself: a cycle of postures, or some seconds of set points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.bodies.cycles import CycleTracks
from bns.diagnose.data.bodies.joints import JointTracks
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.measurements import SET
from bns.physics.jointed.drives import RUN_UP_S, Drive, at_times, through_postures
from bns.physics.jointed.mechanism import Mechanism
from bns.robots.snake.gait import COMMANDS_A_CYCLE, joint_angles
from bns.robots.snake.table import GAIT

_LASTS_S = DEFAULTS.data.stretch_s
_RUN_UP = DEFAULTS.data.run_up_postures
_CLEAR = DEFAULTS.data.sites_clear
_BEGIN_CLEAR = DEFAULTS.data.sites_clear_at_begin
MOST_ABOUT = DEFAULTS.data.stretch_variables


class Told(Protocol):
    """What the servos were told in a stretch."""

    def drive(self, dt_s: float, begin: Array, looks: int) -> Drive:
        """The same in steps of a simulation, from where the robot was seen; looked at so many times."""

    def commands(self) -> dict[str, Array]:
        """The same as columns of a trial file."""


@dataclass(frozen=True)
class Postures:
    """From posture (postures, joints) to posture; it is first seen in the one that comes after the first ``before``."""

    mechanism: Mechanism
    postures: Array
    before: int
    gait: Array

    def drive(self, dt_s: float, begin: Array, looks: int) -> Drive:
        """As of `Told`."""
        return through_postures(self.mechanism, self.postures, dt_s, begin, looks, self.before)

    def commands(self) -> dict[str, Array]:
        """One cycle of the gait."""
        return {"cycle": np.ones(1), **{name: self.gait[k : k + 1] for k, name in enumerate(GAIT)}}


@dataclass(frozen=True)
class SetPoints:
    """Set points (n, joints) from times t_s (n,) on; seen from ``from_s`` to ``to_s``.

    ``run_up_s`` and ``began`` (joints,): how long before it is simulated, and from which posture a trial began, as of `at_times`.
    """

    t_s: Array
    set_points: Array
    from_s: float
    to_s: float
    joints: tuple[str, ...]
    run_up_s: float = RUN_UP_S
    began: Array | None = None

    @property
    def at_begin(self) -> Array:
        """The set points that are in force when the stretch begins, (joints,)."""
        now: Array = self.set_points[np.searchsorted(self.t_s, self.from_s, side="right") - 1]
        return now

    def drive(self, dt_s: float, begin: Array, looks: int) -> Drive:
        """As of `Told`."""
        return at_times(self.t_s, self.set_points, (self.from_s, self.to_s), dt_s, begin, looks, self.run_up_s, self.began)

    def commands(self) -> dict[str, Array]:
        """Rows from what is in force when the joints are brought to where they are, to the last one."""
        start = max(self.from_s - self.run_up_s, float(self.t_s[0]))
        first = int(np.searchsorted(self.t_s, start, side="right")) - 1
        rows = slice(max(first, 0), int(np.searchsorted(self.t_s, self.to_s, side="left")))
        told = {f"{name}{SET}": self.set_points[rows, k] for k, name in enumerate(self.joints)}
        return {"t_s": np.maximum(self.t_s[rows] - start, 0.0), **told}


@dataclass(frozen=True, kw_only=True)
class StretchTracks(Tracks):
    """Frames of stretches one after the other.

    ``points_m`` (frames, sites, 2); ``stretch`` (frames,): of which each is; ``since_s`` (frames,) since its first frame,
    infinite where a frame is seen when all is done. ``told`` (stretches); ``about``: name -> (stretches,), what they differ in.
    """

    points_m: Array
    stretch: NDArray[np.int64]
    since_s: Array
    told: tuple[Told, ...]
    about: Mapping[str, Array]

    @property
    def timed(self) -> bool:
        """Are there frames at times of their own, so that a clock can be wrong?"""
        return bool((np.bincount(self.stretch) > 2).any())

    @property
    def begins(self) -> NDArray[np.int64]:
        """The first frame of each stretch, (stretches,)."""
        return np.flatnonzero(np.diff(self.stretch, prepend=-1))

    @property
    def ends(self) -> NDArray[np.int64]:
        """The last frame of each, (stretches,)."""
        return np.append(self.begins[1:], len(self.stretch)) - 1

    def of(self, chosen: NDArray[np.int64]) -> StretchTracks:
        """Some of the stretches; trials without any are left out."""
        frames = np.flatnonzero(np.isin(self.stretch, chosen))
        kept, counts = np.unique(self.trial[frames], return_counts=True)
        number = np.searchsorted(chosen, self.stretch[frames])
        first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        jumped = np.diff(number, prepend=-1) > 0
        jumped[first[:-1]] = False
        return replace(
            self,
            names=tuple(self.names[i] for i in kept),
            first=first,
            t_s=self.t_s[frames],
            pose=self.pose[frames],
            left_m_s=self.left_m_s[kept],
            right_m_s=self.right_m_s[kept],
            duration_s=self.duration_s[kept],
            start_s=self.start_s[kept],
            jumped=jumped,
            points_m=self.points_m[frames],
            stretch=number,
            since_s=self.since_s[frames],
            told=tuple(self.told[i] for i in chosen),
            about={name: values[chosen] for name, values in self.about.items()},
        )


def apart(points_m: Array) -> Array:
    """Distances of points to the first, and of the inner ones to the last: what a pose does not hold; (frames, 2 sites - 3)."""
    first = [points_m[:, k] - points_m[:, 0] for k in range(1, points_m.shape[1])]
    last = [points_m[:, k] - points_m[:, -1] for k in range(1, points_m.shape[1] - 1)]
    return np.array([np.hypot(line[:, 0], line[:, 1]) for line in (*first, *last)]).reshape(-1, len(points_m)).T


def poses_of(points_m: Array) -> Array:
    """The middle of the points and the direction from the first to the last, (frames, 3); of one point the direction is 0."""
    line = points_m[:, -1] - points_m[:, 0]
    return np.column_stack([points_m.mean(axis=1), np.arctan2(line[:, 1], line[:, 0])])


def stretches_of_cycles(tracks: CycleTracks, mechanism: Mechanism, joints: int) -> StretchTracks:
    """Every stable cycle, from its first posture to its last, with what a camera saw in between."""
    chosen = np.flatnonzero(tracks.stable)
    points, since, number, times = [], [], [], []
    for place, cycle in enumerate(chosen):
        inner = tracks.between[cycle] if tracks.between else (np.zeros(0), np.zeros((0, 2, 2)))
        points.append(np.concatenate([tracks.markers_m[2 * cycle][None], inner[1], tracks.markers_m[2 * cycle + 1][None]]))
        since.append(np.concatenate([[0.0], inner[0], [np.inf]]))
        number.append(np.full(len(since[-1]), place))
        begin, end = tracks.t_s[2 * cycle], tracks.t_s[2 * cycle + 1]
        times.append(np.concatenate([[begin], begin + inner[0], [end]]))
    about = {name: tracks.gait[chosen, i] for i, name in enumerate(GAIT)} | {"cycle": tracks.number[chosen].astype(float)}
    told = [Postures(mechanism, *_postures(tracks, int(c), joints), tracks.gait[c]) for c in chosen]
    return _joined(tracks, tracks.trial[2 * chosen], points, since, number, times, told, about)


def stretches_of_joints(
    tracks: JointTracks,
    mechanism: Mechanism,
    joints: Sequence[str],
    began: Sequence[Array | None] | None = None,
) -> StretchTracks:
    """Trials cut into stretches of some seconds; what was told `RUN_UP_S` before one brings the joints to where they are.

    ``began`` (trials): the posture in which each began, None where that is its first set points.

    The direction from the first site to the last is the heading: no stretch begins where they are near to one another, as those
    of an arm may be that is seen from above, and poses where they nearly coincide are left out.
    """
    columns = [tracks.joints.index(name) for name in joints]
    order = [tracks.sites.index(name) for name in mechanism.sites]
    points, since, number, times, of = [], [], [], [], []
    told: list[SetPoints] = []
    clear = _clear(tracks.points_m[:, order])
    for trial in range(len(tracks)):
        frames = np.arange(tracks.first[trial], tracks.first[trial + 1])
        t = tracks.t_s[frames]
        rows = tracks.rows[trial]
        for begin in np.arange(t[0] + RUN_UP_S, t[-1] - _LASTS_S / 2, _LASTS_S):
            inside = frames[(t >= begin) & (t < begin + _LASTS_S)]
            if len(inside) < 2 or (tracks.jumped is not None and tracks.jumped[inside[1:]].any()):
                continue  # too few poses, or some in between were left out
            inside = inside[np.cumsum(clear[inside] >= _BEGIN_CLEAR) > 0]
            inside = inside[clear[inside] >= _CLEAR]
            if len(inside) < 2:
                continue
            from_s, to_s = tracks.t_s[inside[0]], tracks.t_s[inside[-1]]
            points.append(tracks.points_m[inside][:, order])
            since.append(tracks.t_s[inside] - from_s)
            times.append(tracks.t_s[inside])
            number.append(np.full(len(inside), len(told)))
            start = began[trial] if began else None
            told.append(SetPoints(rows[0], rows[1][:, columns], from_s, to_s, tuple(joints), began=start))
            of.append(trial)
    if not told:
        raise DataError(f"No trial lasts {RUN_UP_S + _LASTS_S:g} s, for a stretch and the time before it; give longer trials.")
    about = {f"{name}{SET}": np.array([s.at_begin[k] for s in told]) for k, name in enumerate(joints[:MOST_ABOUT])}
    return _joined(tracks, np.array(of, dtype=np.int64), points, since, number, times, told, about)


def _clear(points_m: Array) -> Array:
    """How far the first site is from the last in each frame, as a share of what is usual, (frames,); 1 for a single site."""
    apart_m = np.hypot(*(points_m[:, -1] - points_m[:, 0]).T)
    usual_m = float(np.median(apart_m)) if len(apart_m) else 0.0
    return apart_m / usual_m if usual_m > 0 else np.ones(len(points_m))


def _joined(
    tracks: Tracks,
    trial: NDArray[np.int64],
    points: Sequence[Array],
    since: Sequence[Array],
    number: Sequence[Array],
    times: Sequence[Array],
    told: Sequence[Told],
    about: Mapping[str, Array],
) -> StretchTracks:
    counts = np.array([len(s) for s in since])
    of_frame = np.repeat(trial, counts)
    kept, frames = np.unique(of_frame, return_counts=True)
    first = np.concatenate([[0], np.cumsum(frames)]).astype(np.int64)
    stretch = np.concatenate(number).astype(np.int64)
    jumped = np.diff(stretch, prepend=-1) > 0
    jumped[first[:-1]] = False
    points_m, nothing = np.concatenate(points), np.zeros((len(kept), 0))
    return StretchTracks(
        names=tuple(tracks.names[i] for i in kept),
        first=first,
        t_s=np.concatenate(times),
        pose=poses_of(points_m),
        left_m_s=nothing,
        right_m_s=nothing,
        duration_s=nothing,
        start_s=tracks.start_s[kept],
        start_known=tracks.start_known,
        jumped=jumped,
        points_m=points_m,
        stretch=stretch,
        since_s=np.concatenate(since),
        told=tuple(told),
        about=dict(about),
    )


def _postures(tracks: CycleTracks, cycle: int, joints: int) -> tuple[Array, int]:
    """The last postures of the cycle before, then those of the cycle; and how many the former are."""
    t, gait, number = np.arange(COMMANDS_A_CYCLE), tracks.gait, tracks.number
    angles = joint_angles(gait[cycle], t, joints)
    begins = 2 * cycle in tracks.first
    if not begins and number[cycle] == number[cycle - 1] + 1:
        before = joint_angles(gait[cycle - 1], t[-_RUN_UP:], joints)
    else:
        before = np.zeros((1, joints)) if number[cycle] == 1 else angles[:1]
    return np.vstack([before, angles]), len(before)
