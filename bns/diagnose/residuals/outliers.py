"""Moments that stand out: nothing is wrong most of the time, and now and then a great deal is.

A patch of floor that few trials cross, a wheel that slips, a cable that snags: too few trials show it for a curve along any
variable to be certain, and what is not foreseen there passes for scatter of the drive. But honest scatter is alike
everywhere: no window of frames is many times as far off as most are.

Errors of a tracker that share something with those of the frames before are far off as well, and longest where the robot
stands and nothing else is expected. They are no motion. So a window counts only if the track alone shows it too: what it moved
from one end of the window to the other is many times as far from the prediction as in most windows.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import comb

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.robust import robust_sd
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.residuals.unforeseen import unforeseen_way, ways
from bns.diagnose.settings import DEFAULTS

WIDTH = DEFAULTS.residuals.outlier_frames
FAR = DEFAULTS.residuals.outlier_far
MOVED = DEFAULTS.residuals.outlier_moved
TRIALS = DEFAULTS.residuals.outlier_trials
JUMP = DEFAULTS.residuals.fault_jump
WAYS = DEFAULTS.residuals.fault_ways
TURN = DEFAULTS.residuals.fault_turn
ALONE = DEFAULTS.residuals.outlier_alone
CHANCE = DEFAULTS.residuals.chance
STILL = DEFAULTS.residuals.outlier_still
LATER = DEFAULTS.residuals.outlier_late
MOSTLY = DEFAULTS.residuals.outlier_mostly
_CLIP = DEFAULTS.residuals.clip
STOOD, LATE = "stood still", "did what it had been told shortly before"


@dataclass(frozen=True)
class Outlier:
    """The worst window of a trial that has one which stands out, and what the robot did in it.

    When it began in its trial, how long it lasted, how far off it is (robust standard deviations of all windows), where it
    began, and how far the robot came and turned from its beginning to its end, by the track and by the model.
    """

    trial: str
    t_s: float
    size: float
    lasted_s: float
    x_m: float
    y_m: float
    moved_m: float
    turned_rad: float
    predicted_m: float
    predicted_rad: float
    strayed_m: float = 0.0
    """How far it came from where it was predicted, at any frame of the window."""
    ended_m: float = 0.0
    """How far it was from there at the end of the window."""
    left_m: float = 0.0
    right_m: float = 0.0
    """How much farther each wheel came than predicted, in the direction in which it was predicted to turn; less is negative."""
    did: str = ""
    """`STOOD`, or `LATE`; "" if neither."""

    @property
    def in_words(self) -> str:
        """All of it in a clause."""
        return f"trial {self.trial} {self.when}"

    @property
    def wheel(self) -> str:
        """The wheel that alone did not turn as predicted; "" where both did not."""
        less, more = sorted((abs(self.left_m), abs(self.right_m)))
        return "" if less >= ALONE * more else "left" if abs(self.left_m) == more else "right"

    @property
    def when(self) -> str:
        """The same, without the trial."""
        turned, predicted = (round(np.degrees(angle)) for angle in (self.turned_rad, self.predicted_rad))
        moved, expected = f"{1e3 * self.moved_m:.0f} mm", f"{1e3 * self.predicted_m:.0f} mm"
        alike = (moved, turned) == (expected, predicted)
        between = f", but up to {1e3 * self.strayed_m:.0f} mm from where it was predicted on the way" if alike else ""
        if self.ended_m**2 > 2.0 * (self.moved_m - self.predicted_m) ** 2:  # most of it is a difference of direction
            between = f", in another direction: it ended {1e3 * self.ended_m:.0f} mm from there"
        return (
            f"at {self.t_s:.2f} s, near ({self.x_m:.2f}, {self.y_m:.2f}) m: moved {moved} and turned {turned}° in "
            f"{self.lasted_s:.2f} s, predicted {expected} and {predicted}°{between}"
        )


@dataclass(frozen=True)
class JudgedWindows:
    """Windows that do not overlap and are near no jump of the tracker: the frame after which each begins, how far off each is
    (robust standard deviations), and whether it stands out; (windows,) each."""

    start: NDArray[np.int64]
    size: Array
    stands_out: NDArray[np.bool_]


def judged_windows(problem: Problem, fit: Fit) -> JudgedWindows:
    """All windows of these tracks under a fitted model."""
    start = _windows(problem.predictor.tracks.first)
    start = start[~_near(_jumped(problem, fit), start)]
    if not len(start):
        return JudgedWindows(start, np.zeros(0), np.zeros(0, dtype=bool))
    whitened = np.clip(fit.whitened, -_CLIP, _CLIP)
    sums = whitened[start[:, None] + np.arange(WIDTH)].sum(axis=1) / np.sqrt(WIDTH)
    usual = robust_sd(sums, axis=0)
    size = np.abs(sums / np.maximum(usual, 1e-9)).max(axis=1)
    return JudgedWindows(start, size, (size > FAR) & (_moved(problem, fit, start) > MOVED))


def outliers(problem: Problem, fit: Fit, judged: JudgedWindows | None = None) -> list[Outlier]:
    """One for every trial with a window that stands out, the worst first; none where fewer than `TRIALS` have one.

    ``judged``: what `judged_windows` gave, where that is known.
    """
    tracks, judged = problem.predictor.tracks, judged or judged_windows(problem, fit)
    start, size = judged.start, judged.size
    worst = worst_of_trials(tracks, judged)
    if len(worst) < TRIALS:
        return []
    found = [moment_at(problem, fit, int(start[i]), float(size[i])) for i in worst.values()]
    return sorted(found, key=lambda o: -o.size)


def worst_of_trials(tracks: Tracks, judged: JudgedWindows) -> dict[int, int]:
    """The worst of the windows that stand out, of each trial that has one; trial to window."""
    return {int(tracks.trial[judged.start[i]]): int(i) for i in np.argsort(judged.size) if judged.stands_out[i]}


def moment_at(problem: Problem, fit: Fit, start: int, size: float) -> Outlier:
    """The window that begins with this frame."""
    tracks, begin, end = problem.predictor.tracks, start - 1, start + WIDTH - 1
    ends = np.arange(begin + 1, end + 1)
    every, strayed = ways(problem, fit, np.full(len(ends), begin), ends)
    driven, off = every[-1], strayed[-1]
    half_m = getattr(fit.model, "wheelbase_m", 0.0) / 2  # of a body on joints: no wheels
    wheels = [np.sign(driven[0] + side * driven[2]) * (off[0] + side * off[2]) for side in (-half_m, half_m)]
    way, turned = np.hypot(*(driven + off)[:2]), driven[2] + off[2]
    x, y, _ = tracks.pose[begin]
    return Outlier(
        tracks.names[int(tracks.trial[start])],
        float(tracks.own_s[start]),
        size,
        lasted_s=float(tracks.own_s[end] - tracks.own_s[begin]),
        x_m=float(x),
        y_m=float(y),
        moved_m=float(way),
        turned_rad=float(turned),
        predicted_m=float(np.hypot(*driven[:2])),
        predicted_rad=float(driven[2]),
        strayed_m=float(np.hypot(*strayed.T[:2]).max()),
        ended_m=float(np.hypot(*off[:2])),
        left_m=float(wheels[0]),
        right_m=float(wheels[1]),
        did=_did(problem, fit, begin, end, half_m),
    )


def _did(problem: Problem, fit: Fit, begin: int, end: int, half_m: float) -> str:
    """What the robot did from frame ``begin`` to ``end``: nothing, or what the model says of a window a little earlier."""
    tracks, sizes = problem.predictor.tracks, np.array([1.0, 1.0, half_m])
    back = np.arange(min(WIDTH, begin - int(tracks.first[tracks.trial[begin]])) + 1)
    predicted, off = ways(problem, fit, begin - back, end - back)
    moved = predicted[0] + off[0]
    if np.linalg.norm(moved * sizes) < STILL * np.linalg.norm(predicted[0] * sizes):
        return STOOD
    missed = np.linalg.norm((predicted - moved) * sizes, axis=1)
    return LATE if missed.min() < LATER * missed[0] else ""


def what_they_did(moments: Sequence[Outlier]) -> str:
    """What the robot did in most of them, in a clause; "" where it did this and that."""
    stood, late = (sum(moment.did in kinds for moment in moments) for kinds in ({STOOD}, {STOOD, LATE}))
    if stood >= MOSTLY * len(moments):
        return f"in {stood} of these {len(moments)} moments the robot {STOOD}, whatever it was told"
    if late >= MOSTLY * len(moments):
        return f"in {late} of these {len(moments)} moments the robot {LATE}, or stood still: commands come late, or are lost"
    return ""


def one_wheel(moments: Sequence[Outlier]) -> str:
    """The wheel that alone turned less than predicted, or more, in most of them, in a clause; "" where chance would do the same.

    A wheel that turns less at times and more at others is no wheel that slips: a mistaken marker beside it seems to turn so.
    """
    ways = [(moment.wheel, _less(moment)) for moment in moments if moment.wheel]
    side, less = max(itertools.product(("left", "right"), (True, False)), key=ways.count)
    same = ways.count((side, less))
    as_many = sum(comb(len(ways), k) for k in range(same, len(ways) + 1))
    if not same or 2 * as_many >= CHANCE * 2 ** len(ways):
        return ""
    return f"in {same} of these moments the {side} wheel alone turned {'less' if less else 'more'} than predicted"


def _less(moment: Outlier) -> bool:
    return (moment.left_m if moment.wheel == "left" else moment.right_m) < 0.0


def _windows(first: NDArray[np.int64]) -> NDArray[np.int64]:
    """The frame where each window begins; windows do not overlap."""
    return np.concatenate([np.arange(a + 1, b - WIDTH + 1, WIDTH) for a, b in pairwise(first)]).astype(np.int64)


def _moved(problem: Problem, fit: Fit, start: NDArray[np.int64]) -> Array:
    """How much farther off the way of each window is than in most windows, in its worst direction, (windows,).

    Of the track alone: no filter follows it. The least of three windows, each a frame shorter at both ends, so that no single
    mistaken marker counts.
    """
    ways = [unforeseen_way(problem, fit, start - 1 + i, start + WIDTH - 1 - i) for i in range(3)]
    sizes = [np.abs(way / np.maximum(robust_sd(way, axis=0), 1e-12)).max(axis=1) for way in ways]
    return np.asarray(np.min(sizes, axis=0))


def _jumped(problem: Problem, fit: Fit) -> NDArray[np.bool_]:
    """Frames (frames,) that are farther off than any robot gets within one, or where the tracker was seen to jump."""
    possible = JUMP + WAYS * problem.predictor.way_m / problem.pose_filter.noise[0]
    off = np.abs(fit.whitened)
    far = (off[:, :2].max(axis=1) > possible) | (off[:, 2] > TURN)
    marked = problem.predictor.tracks.jumped
    return np.asarray(far if marked is None else far | marked)


def _near(frames: NDArray[np.bool_], start: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Windows (windows,) with such a frame in them or less than a window away."""
    count = np.concatenate([[0], np.cumsum(frames)])
    return np.asarray(count[np.minimum(start + 2 * WIDTH, len(frames))] > count[np.maximum(start - WIDTH, 0)])
