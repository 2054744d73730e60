"""How far predictions are off, from the measured pose, after a command, a second, five seconds, a whole trial."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.bodies.stretches import StretchTracks
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.predict.base import Predictor, Steps
from bns.diagnose.settings import DEFAULTS

HORIZONS = ("command", "1s", "5s", "trial")
_SECONDS = dict(DEFAULTS.predict.horizons_s)
IN_WORDS = {
    "command": "one command",
    "1s": "1 second",
    "5s": "5 seconds",
    "trial": "the whole trial",
    "cycle": "one cycle",
    "change": "one change of cycles",
    "stretch": "one stretch",
}
"""How far ahead, as people read it."""


@dataclass(frozen=True)
class Errors:
    """Errors at the ends of windows, one row each.

    start, end: (windows,) frames; forward_m, left_m: in the robot's frame at the window's end as measured; heading_rad.
    """

    trial: NDArray[np.int64]
    start: NDArray[np.int64]
    end: NDArray[np.int64]
    forward_m: Array
    left_m: Array
    heading_rad: Array
    points_m: Array | None = None
    """Of several tracked points: how far these are off beside their middle, by the turn and by their distances, (windows,)."""

    def only(self, kept: NDArray[np.bool_]) -> Errors:
        """Some of the windows."""
        frames = self.trial[kept], self.start[kept], self.end[kept]
        points_m = None if self.points_m is None else self.points_m[kept]
        return Errors(*frames, self.forward_m[kept], self.left_m[kept], self.heading_rad[kept], points_m)

    @property
    def position_m(self) -> Array:
        """Distance between predicted and measured position, (windows,); of several tracked points the root mean square."""
        middle_m: Array = np.hypot(self.forward_m, self.left_m)
        return middle_m if self.points_m is None else np.hypot(middle_m, self.points_m)

    def summary(self, trials: int) -> dict[str, float]:
        """Root mean squares, the median position error, its standard error by trial, and the number of windows.

        One trial has no standard error: NaN.
        """
        if not len(self.start):
            return {"windows": 0}
        square = self.position_m**2
        sums = np.bincount(self.trial, square, trials)
        counts = np.bincount(self.trial, minlength=trials)
        mean = float(square.mean())
        rms = float(np.sqrt(mean))
        scatter = float(np.sqrt(((sums - mean * counts) ** 2).sum()) / counts.sum())
        return {
            "position_m": rms,
            "position_se_m": float("nan") if np.count_nonzero(counts) < 2 else scatter / (2 * rms) if rms > 0 else 0.0,
            "median_position_m": float(np.median(self.position_m)),
            "forward_m": _rms(self.forward_m),
            "left_m": _rms(self.left_m),
            "heading_rad": _rms(self.heading_rad),
            "windows": len(self.start),
        }


def _rms(values: Array) -> float:
    return float(np.sqrt((values * values).mean()))


def windows(tracks: Tracks, horizon: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Frames at which the windows of a horizon begin and end, back to back within each trial."""
    begins: list[int] = []
    ends: list[int] = []
    for trial in range(len(tracks)):
        a, b = int(tracks.first[trial]), int(tracks.first[trial + 1])
        marks = _marks(tracks, trial, horizon, tracks.t_s[a:b])
        frames = a + np.unique(marks)
        begins += list(frames[:-1])
        ends += list(frames[1:])
    return np.array(begins, dtype=np.int64), np.array(ends, dtype=np.int64)


def _marks(tracks: Tracks, trial: int, horizon: str, t_s: Array) -> NDArray[np.int64]:
    if len(t_s) < 2:
        return np.zeros(1, dtype=np.int64)
    if horizon == "trial":
        return np.array([0, len(t_s) - 1])
    if horizon == "command":
        times = np.concatenate([[0.0], np.cumsum(tracks.duration_s[trial])])
    else:
        times = np.arange(0.0, t_s[-1] + 1e-9, _SECONDS[horizon])
    times = times[times <= t_s[-1] + 1e-6]
    return np.searchsorted(t_s, times - 1e-6).clip(max=len(t_s) - 1)


def errors_of(predictor: Predictor, steps: Steps, horizon: str) -> Errors:
    """Measured minus predicted at the ends of a horizon's windows, each predicted from the pose measured at its start."""
    tracks = predictor.tracks
    start, end = predictor.windows(horizon)
    path = _path(tracks, steps)
    pose = tracks.pose
    turn = pose[start, 2] - path[start, 2]
    cos, sin = np.cos(turn), np.sin(turn)
    dx, dy = path[end, 0] - path[start, 0], path[end, 1] - path[start, 1]
    drift = np.cumsum(steps.drift_m, axis=0)
    ex = pose[end, 0] - (pose[start, 0] + cos * dx - sin * dy + drift[end, 0] - drift[start, 0])
    ey = pose[end, 1] - (pose[start, 1] + sin * dx + cos * dy + drift[end, 1] - drift[start, 1])
    eh = pose[end, 2] - (pose[start, 2] + path[end, 2] - path[start, 2])
    eh -= 2 * np.pi * np.round(eh / (2 * np.pi))
    c, s = np.cos(pose[end, 2]), np.sin(pose[end, 2])
    points_m = None
    if isinstance(tracks, StretchTracks) and steps.apart_m is not None:
        points_m = np.sqrt((_radius_m(tracks)[end] * eh) ** 2 + (steps.apart_m[end] ** 2).mean(axis=1) / 4)
    return Errors(tracks.trial[start], start, end, c * ex + s * ey, c * ey - s * ex, eh, points_m)


def _radius_m(tracks: StretchTracks) -> Array:
    """How far tracked points are from their middle, (frames,); root mean square."""
    off = tracks.points_m - tracks.points_m.mean(axis=1, keepdims=True)
    return np.asarray(np.sqrt((off**2).sum(axis=2).mean(axis=1)))


def _path(tracks: Tracks, steps: Steps) -> Array:
    """The predicted path of every trial from the origin, (frames, 3): displacements in the robot's frame put end to end."""
    turns = np.cumsum(steps.body[:, 2])
    heading = turns - turns[tracks.first[:-1]][tracks.trial]
    before = heading - steps.body[:, 2]
    cos, sin = np.cos(before), np.sin(before)
    x = np.cumsum(cos * steps.body[:, 0] - sin * steps.body[:, 1])
    y = np.cumsum(sin * steps.body[:, 0] + cos * steps.body[:, 1])
    begin = tracks.first[:-1]
    return np.stack([x - x[begin][tracks.trial], y - y[begin][tracks.trial], heading], axis=1)


def laid_paths(tracks: Tracks, steps: Steps) -> Array:
    """Predicted poses (frames, 3) of every trial, begun at its first measured pose, and again where it goes on elsewhere."""
    path, drift = _path(tracks, steps), np.cumsum(steps.drift_m, axis=0)
    begin = np.maximum.accumulate(np.where(tracks.is_first, np.arange(len(tracks.t_s)), 0))
    start = tracks.pose[begin]
    turn = start[:, 2] - path[begin, 2]
    cos, sin = np.cos(turn), np.sin(turn)
    way, drift = path - path[begin], drift - drift[begin]
    x = start[:, 0] + cos * way[:, 0] - sin * way[:, 1] + drift[:, 0]
    y = start[:, 1] + sin * way[:, 0] + cos * way[:, 1] + drift[:, 1]
    return np.stack([x, y, start[:, 2] + way[:, 2]], axis=1)
