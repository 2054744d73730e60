"""When a robot rests, from the tracks alone: after commands of zero, and without the poses in which it still coasts.

A robot that coasts goes on along the way on which it drove, and comes to rest. A tracker's noise goes on as often as it goes
back, slow wander included, and so does creeping down a slope after drives in all directions. So changes that go back along the
way show how large those are that come of no coasting; what goes on by much more is motion.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.robust import robust_sd
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.settings import DEFAULTS

SETTLED_S = DEFAULTS.data.settled_s
GOES_ON = DEFAULTS.data.rest_goes_on
PARTS = DEFAULTS.data.rest_parts
FEWEST_LEFT = DEFAULTS.data.rest_fewest_left
_LEAST = DEFAULTS.data.rest_least


@dataclass(frozen=True)
class Rest:
    """Times (n,) in s and poses (n, 3) in m and rad, headings unwrapped, of a robot that is told to stand.

    ``way`` (3,): how its pose changed just before; zeros where it was not told to move before.
    """

    t_s: Array
    pose: Array
    way: Array

    def later(self) -> Rest:
        """Without its first part."""
        cut = max(len(self.t_s) // PARTS, 1)
        return Rest(self.t_s[cut:], self.pose[cut:], self.way)


def told_to_stand(tracks: Tracks) -> Iterator[Rest]:
    """Each command of zero from `SETTLED_S` after its begin, where it has enough poses to tell of noise."""
    for trial, (a, b) in enumerate(pairwise(tracks.first)):
        t_s, ends = tracks.t_s[a:b], np.cumsum(tracks.duration_s[trial])
        pose = np.column_stack([tracks.pose[a:b, :2], np.unwrap(tracks.pose[a:b, 2])])
        still = (tracks.left_m_s[trial] == 0) & (tracks.right_m_s[trial] == 0)
        for k in np.flatnonzero(still):
            stop = ends[k] - tracks.duration_s[trial][k]
            inside = (t_s >= stop + SETTLED_S) & (t_s <= ends[k])
            if inside.sum() >= 5:  # fewer share their mean with their noise
                way = np.zeros(3) if still[:k].all() else _way(t_s, pose, stop)
                yield Rest(t_s[inside], pose[inside], way)


def _way(t_s: Array, pose: Array, stop: float) -> Array:
    """How the pose changed in the last `SETTLED_S` before a stop; just after it where poses begin later."""
    since, until, counted = np.searchsorted(t_s, [stop - SETTLED_S, stop, stop + SETTLED_S])
    last = (until if until - since >= 2 else counted) - 1
    return np.asarray(pose[last] - pose[since]) if last > since else np.zeros(3)


def settled(rests: Sequence[Rest]) -> list[Rest]:
    """The rests, each from when its begin no longer goes on; those that never come to rest are left out."""
    left = list(rests)
    while left:
        on = _goes_on(left)
        if not on.any():
            break
        cut = [(rest.later(), FEWEST_LEFT) if goes_on else (rest, 0) for rest, goes_on in zip(left, on, strict=True)]
        left = [rest for rest, fewest in cut if len(rest.t_s) >= fewest]
    return left


def _goes_on(rests: Sequence[Rest]) -> NDArray[np.bool_]:
    """Rests (rests,) whose first part is further back on the way than noise explains."""
    along = [_along(rest) for rest in rests]
    begins = np.array([_step(one) for one in along])
    ends = np.array([-_step(one[::-1]) for one in along])
    usual = np.maximum(_quick([one for one, rest in zip(along, rests, strict=True) if rest.way.any()]), _LEAST)
    for channel, steps in enumerate(np.vstack([begins, ends]).T):
        if (steps < 0).any():
            usual[channel] = max(usual[channel], float(robust_sd(steps[steps < 0])))
    return np.asarray((begins > GOES_ON * usual).any(axis=1))


def _along(rest: Rest) -> Array:
    """Positions along the way on which the robot drove (m), headings in the sense in which it turned (rad): (n, 2)."""
    far = float(np.hypot(*rest.way[:2]))
    ahead = rest.way[:2] / far if far else rest.way[:2]
    return np.column_stack([rest.pose[:, :2] @ ahead, rest.pose[:, 2] * np.sign(rest.way[2])])


def _step(values: Array) -> Array:
    """From the mean of the first part to that of the others, (2,), as large as one pose's noise if poses share none."""
    first = max(len(values) // PARTS, 1)
    spread = np.sqrt(1 / first + 1 / (len(values) - first))
    return np.asarray((values[first:].mean(axis=0) - values[:first].mean(axis=0)) / spread)


def _quick(along: Sequence[Array]) -> Array:
    """Noise that poses do not share, (2,): steady motion adds nothing to second differences. Repeated poses count once."""
    fresh = [one[np.append(True, np.diff(one, axis=0).any(axis=1))] for one in along]
    bends = [np.diff(one, 2, axis=0) for one in fresh if len(one) > 2]
    if not bends:
        return np.zeros(2)
    repeats = sum(map(len, along)) / sum(map(len, fresh))
    return np.asarray(robust_sd(np.concatenate(bends), axis=0) * np.sqrt(repeats / 6))
