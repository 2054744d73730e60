"""Do the moments that stand out share a place, a direction or a time? Asked of where they begin, beside where the robots drove.

A marker that is mistaken behind a line, a threshold, a magnet under the floor: what the robot is told says nothing of it. But the
moments then begin in a narrow range of one coordinate, in which the same trials spend little of their time. Or in a part of the
session, as when something came loose: trials before and after it have none.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.residuals.outliers import JudgedWindows, worst_of_trials
from bns.diagnose.settings import DEFAULTS

CHANCE = DEFAULTS.residuals.chance
FEWEST = DEFAULTS.residuals.share_fewest
PURE = DEFAULTS.residuals.share_pure
_X = "x is between {0:.2f} and {1:.2f} m"
_TIME = "the trial has lasted {0:.1f} to {1:.1f} s"
_HEADING = "the heading is between {0:.0f} and {1:.0f}°"
SESSION = "the session has lasted {0:.0f} to {1:.0f} s"
_CLAUSES = (_X, "y is between {0:.2f} and {1:.2f} m", _HEADING, _TIME, SESSION)
"""Each coordinate with its two ends, as a clause."""


@dataclass(frozen=True)
class SharedPlace:
    """The range of a coordinate in which nearly all moments that stand out begin, and few other windows of the same trials.

    ``clause``: the coordinate, with places for both ends; ``low``, ``high``: the ends in m, rad or s, those of a heading from 0
    on, the second up to two turns. ``inside`` of ``moments`` begin there, and the fraction ``usual`` of all windows of their
    trials; of a part of the session, of all trials.
    """

    clause: str
    low: float
    high: float
    inside: int
    moments: int
    usual: float

    @property
    def in_words(self) -> str:
        """A clause."""
        ends = (np.degrees([self.low, self.high]) + 180) % 360 - 180 if self.clause == _HEADING else (self.low, self.high)
        where = self.clause.format(*ends)
        if self.clause == _TIME and f"{self.low:.1f}" == f"{self.high:.1f}":
            where = f"the trial has lasted {self.low:.1f} s"
        which = "all" if self.inside == self.moments else f"{self.inside} of"
        driven = "what was driven is driven then" if self.clause == SESSION else "the same trials is driven there"
        when = "when" if self.clause == SESSION else "where"
        return f"{which} these {self.moments} moments begin {when} {where}; {self.usual:.0%} of {driven}"

    @property
    def to_look_for(self) -> str:
        """What may differ there."""
        if self.clause == SESSION:
            return "Look for what was different then: a screw, a cable or a tyre that is loose, a battery, heat, a hand."
        return "Look at what differs there: the floor, tracking, a cable."


def shared_place(problem: Problem, judged: JudgedWindows) -> SharedPlace | None:
    """Where the worst moments of the trials begin; None where they are few, or might begin there by chance.

    By chance each begins in any window of its trial, and in any trial. All ranges between two moments are paid for, of every
    coordinate.
    """
    from scipy.stats import binom  # noqa: PLC0415  # slow to load

    tracks = problem.predictor.tracks
    worst = worst_of_trials(tracks, judged)
    if len(worst) < FEWEST or tracks.relative:
        return None
    trial, begin, there = tracks.trial[judged.start], judged.start - 1, list(worst.values())
    found, least = None, CHANCE
    for clause, values in zip(_CLAUSES, [*tracks.pose[begin].T, tracks.own_s[begin], tracks.session_s[begin]], strict=True):
        first = _largest_gap(values[there]) if clause == _HEADING else float(values.min())
        along = np.mod(values - first, math.tau) if clause == _HEADING else values - first
        for low, high in _narrowest(along[there]):
            within = (along >= low) & (along <= high)
            usual = float(within.mean() if clause == SESSION else np.mean([within[trial == one].mean() for one in worst]))
            inside = int(within[there].sum())
            chance = float(binom.sf(inside - 1, len(there), usual)) * len(_CLAUSES) * len(there) ** 2 / 2
            if chance < least:
                least, found = chance, SharedPlace(clause, low + first, high + first, inside, len(there), usual)
    return found


def _narrowest(values: Array) -> Iterator[tuple[float, float]]:
    """The narrowest range that holds k of the values, for each k from the fraction `PURE` of them on."""
    ordered = np.sort(values)
    for k in range(int(np.ceil(PURE * len(ordered))), len(ordered) + 1):
        i = int(np.argmin(ordered[k - 1 :] - ordered[: len(ordered) - k + 1]))
        yield float(ordered[i]), float(ordered[i + k - 1])


def _largest_gap(angles: Array) -> float:
    """The angle at the end of the largest gap between angles on a circle: no narrow range of them crosses it."""
    ordered = np.sort(np.mod(angles, math.tau))
    gaps = np.diff(np.append(ordered, ordered[0] + math.tau))
    return float(ordered[(int(np.argmax(gaps)) + 1) % len(ordered)])
