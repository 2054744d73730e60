"""What do the moments that stand out share? Asked of the changes of command: after which of them does the error become large?

A fault that comes and goes with what the robot is told (a driver that switches off after a large step, a gear that slips at a
reversal) leaves most of the motion as predicted, so no curve through all of it is certain. But then one property of the changes,
with one limit, tells those that such a moment follows from those that none follows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.outliers import WIDTH, JudgedWindows
from bns.diagnose.settings import DEFAULTS

CHANCE = DEFAULTS.residuals.chance
FEWEST = DEFAULTS.residuals.share_fewest
PURE = DEFAULTS.residuals.share_pure
_SPEED, _TIME = "m/s", "s"
_PROPERTIES = (
    ("change both wheels' speeds by {0} in all", _SPEED),
    ("change one wheel's speed by {0} (the larger change)", _SPEED),
    ("change one wheel's speed by {0} (the smaller change)", _SPEED),
    ("change the forward speed by {0}", _SPEED),
    ("change the difference between the wheels' speeds by {0}", _SPEED),
    ("reverse a wheel, which then turns at {0}", _SPEED),
    ("demand a forward speed of {0}", _SPEED),
    ("demand a wheel's speed of {0}", _SPEED),
    ("demand a difference between the wheels' speeds of {0}", _SPEED),
    ("slow a wheel down by {0}", _SPEED),
    ("speed a wheel up by {0}", _SPEED),
    ("come {0} after the change before", _TIME),
    ("come {0} after the beginning of the trial", _TIME),
)
"""What a change of command has, as a clause with a number, and its unit; in the order of `_properties`."""


@dataclass(frozen=True)
class SharedCause:
    """The property that tells the changes of command after which the error becomes large from the others.

    ``clause``: the property, with a place for its number; ``limit`` of it, in ``unit``; ``above``: the error becomes large above
    it. ``followed`` of ``beyond`` changes beyond the limit are followed by such a moment, ``others_followed`` of ``others``.
    """

    clause: str
    unit: str
    limit: float
    above: bool
    followed: int
    beyond: int
    others_followed: int
    others: int

    @property
    def in_words(self) -> str:
        """A clause."""
        limit = f"{'more' if self.above else 'less'} than about {self.limit:.2g} {self.unit}"
        return (
            f"such moments come after commands that {self.clause.format(limit)}: after {self.followed} of {self.beyond} of these "
            f"and after {self.others_followed} of {self.others} others"
        )


@dataclass(frozen=True)
class _Changes:
    """Changes of command: trial and when in it (s), properties (changes, properties)."""

    trial: NDArray[np.int64]
    at_s: Array
    properties: Array


def shared_cause(problem: Problem, judged: JudgedWindows) -> SharedCause | None:
    """What the windows that stand out share; None of robots without wheels, and where no property tells for certain."""
    from scipy.stats import fisher_exact  # noqa: PLC0415  # slow to load

    predictor = problem.predictor
    if not isinstance(predictor, WheelPredictor) or predictor.tracks.relative:
        return None
    changes = _changes(predictor.tracks)
    seen, followed = _followed(predictor.tracks, changes, judged)
    if min(followed.sum(), (seen & ~followed).sum()) < FEWEST:
        return None
    splits = [split for j in range(len(_PROPERTIES)) for split in _splits(changes.properties[seen, j], followed[seen], j)]
    tried = len(splits) * int(seen.sum())  # a limit may lie between any two values
    for _, split in sorted(splits, key=lambda pair: -pair[0]):
        table = [[split.followed, split.beyond - split.followed], [split.others_followed, split.others - split.others_followed]]
        if float(fisher_exact(table)[1]) * tried < CHANCE and _pure(split):
            return split
    return None


def _pure(split: SharedCause) -> bool:
    """Do nearly all changes beyond the limit have such a moment, and nearly all such moments a change beyond it?"""
    return split.followed >= PURE * max(split.beyond, split.followed + split.others_followed)


def _splits(values: Array, followed: NDArray[np.bool_], which: int) -> Iterator[tuple[float, SharedCause]]:
    """The best limit of a property in each direction, with the share that it gets right on both sides."""
    order = np.argsort(values)
    ordered, hit = values[order], followed[order].astype(int)
    apart = np.flatnonzero(np.diff(ordered) > 1e-9)
    if not len(apart):
        return
    below = np.cumsum(hit)[apart]
    under, hits = apart + 1, int(hit.sum())
    for above in (True, False):
        inside, beyond = (hits - below, len(hit) - under) if above else (below, under)
        right = inside / hits + 1.0 - (beyond - inside) / (len(hit) - hits)
        k = int(np.argmax(right))
        limit = float(ordered[apart[k]] + ordered[apart[k] + 1]) / 2
        counts = int(inside[k]), int(beyond[k]), hits - int(inside[k]), len(hit) - int(beyond[k])
        yield float(right[k]), SharedCause(*_PROPERTIES[which], limit, above, *counts)


def _changes(tracks: Tracks) -> _Changes:
    trials, times, rows = [], [], []
    for trial in range(len(tracks)):
        ends = np.cumsum(tracks.duration_s[trial])
        left, right = tracks.left_m_s[trial], tracks.right_m_s[trial]
        lead = 0.0 if tracks.lead_s is None else float(tracks.lead_s[trial])
        before_s = lead
        for k in np.flatnonzero((np.diff(left) != 0) | (np.diff(right) != 0)):
            trials.append(trial)
            times.append(float(ends[k]))
            rows.append(_properties(left[k : k + 2], right[k : k + 2], float(ends[k]) - before_s, float(ends[k]) - lead))
            before_s = float(ends[k])
    return _Changes(np.array(trials, dtype=np.int64), np.array(times), np.array(rows).reshape(-1, len(_PROPERTIES)))


def _properties(left: Array, right: Array, since_s: float, in_trial_s: float) -> list[float]:
    """As `_PROPERTIES`; ``left``, ``right`` (2,): a wheel's speed before and after, m/s."""
    by_left, by_right = float(np.diff(left)[0]), float(np.diff(right)[0])
    sizes = [abs(float(wheel[1])) - abs(float(wheel[0])) for wheel in (left, right)]
    back = [abs(float(wheel[1])) for wheel in (left, right) if wheel[0] * wheel[1] < 0]
    return [
        abs(by_left) + abs(by_right),
        max(abs(by_left), abs(by_right)),
        min(abs(by) for by in (by_left, by_right) if by != 0.0),
        abs(by_left + by_right) / 2,
        abs(by_right - by_left),
        max(back, default=0.0),
        abs(float(left[1] + right[1])) / 2,
        float(max(abs(left[1]), abs(right[1]))),
        abs(float(right[1] - left[1])),
        max(0.0, -min(sizes)),
        max(0.0, *sizes),
        since_s,
        in_trial_s,
    ]


def _followed(tracks: Tracks, changes: _Changes, judged: JudgedWindows) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Changes that have a window of their own, and those of whose windows one stands out, (changes,) each.

    A window is that of the last change before it ends: a moment that a change brings about begins in the window of the change, or
    in one after it. Where one with several changes in it stands out, nobody knows which of them brought it about: they are not
    asked.
    """
    seen, followed, unclear = np.zeros((3, len(changes.trial)), dtype=bool)
    first = np.searchsorted(changes.trial, np.arange(len(tracks) + 1))
    ends = judged.start + WIDTH - 1
    for start, end, stands_out in zip(judged.start, ends, judged.stands_out, strict=True):
        trial = int(tracks.trial[start])
        mine = slice(int(first[trial]), int(first[trial + 1]))
        at_s = changes.at_s[mine]
        inside = np.flatnonzero((at_s > tracks.t_s[start - 1]) & (at_s < tracks.t_s[end]))
        before = int(np.searchsorted(at_s, tracks.t_s[start - 1], side="right")) - 1
        own = inside if len(inside) else np.array([before] if before >= 0 else [], dtype=np.int64)
        seen[mine.start + own] = True
        if stands_out:
            (followed if len(own) == 1 else unclear)[mine.start + own] = True
    return seen & (followed | ~unclear), followed
