"""Do the delays of single commands follow something that is logged, such as where the robot is?

A camera that reads its rows one after another takes a pose the later, the farther down its picture the robot is: every command
there seems to take effect sooner. That is a rule and no scatter. The delays are compared with the place, the heading, the speeds
before and after the change, the time and further columns, each by a straight line; a variable counts where it explains a good
part of the variance of the delays, and where trials pull the same way more than by chance.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.robust import robust_sd
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.estimate.significance import sign_flip_p
from bns.diagnose.settings import DEFAULTS

CHANCE = DEFAULTS.residuals.chance
EXPLAINED = DEFAULTS.residuals.delays_explained
SIMPLER = DEFAULTS.residuals.delays_simpler
FAR = DEFAULTS.residuals.delays_far

_ROWS = ", as if the camera read its picture row by row"
_CLOCKS = ", as if the clock of the tracker and that of the commands did not run equally fast"


@dataclass(frozen=True)
class _Words:
    """``on`` what the delays depend, the unit ``each`` of which makes a difference, and what it looks like."""

    on: str
    each: str
    as_if: str = ""


_WORDS = {
    "x_m": _Words("where the robot is", "metre in x", _ROWS),
    "y_m": _Words("where the robot is", "metre in y", _ROWS),
    "speed_before_m_s": _Words("the speed that was commanded before", "m/s"),
    "speed_after_m_s": _Words("the speed that is commanded", "m/s"),
    "turn_before_rad_s": _Words("the turn rate that was commanded before", "rad/s"),
    "turn_after_rad_s": _Words("the turn rate that is commanded", "rad/s"),
    "fast_before_m_s": _Words("how fast the robot was told to drive before, ahead or back", "m/s"),
    "fast_after_m_s": _Words("how fast the robot is told to drive, ahead or back", "m/s"),
    "session_s": _Words("the time in the session", "minute", _CLOCKS),
    "time_in_trial_s": _Words("the time in the trial", "second", _CLOCKS),
}


@dataclass(frozen=True)
class DelayRule:
    """What the delays of single commands follow.

    ``variable``: its name; ``later_s`` by how much a command is later for each unit of it: one number, of the place along x and
    y (s/m), of the heading along its cosine and its sine (s). ``correlation`` of the delays with it (of two numbers: with the
    best sum of both); ``left_s``: standard deviation of what is left (s).
    """

    variable: str
    later_s: tuple[float, ...]
    correlation: float
    left_s: float

    @property
    def of_place(self) -> bool:
        """Does the delay follow the place of the robot on the floor?"""
        return self.variable in {"x_m", "y_m", "place"}

    @property
    def in_words(self) -> str:
        """A clause."""
        so_well = f" (correlation {self.correlation:.2f}; what is left scatters by {_ms(self.left_s)} ms)"
        size, towards = float(np.hypot(self.later_s[0], self.later_s[-1])), self._towards
        if self.variable == "place":
            said = f"where the robot is: {_ms(size)} ms later for each metre towards {towards:.0f}° from the x axis"
            return f"{_BEGUN}{said}{so_well}{_ROWS}"
        if self.variable == "heading_rad":
            said = f"the robot's heading: latest at {towards:.0f}°, {_ms(size)} ms later there than on average"
            return f"{_BEGUN}{said}{so_well}"
        words = _WORDS.get(self.variable, _Words(self.variable, "unit of it"))
        by = self.later_s[0] * (60.0 if words.each == "minute" else 1.0)
        return f"{_BEGUN}{words.on}: {_ms(by)} ms {'later' if by > 0 else 'earlier'} for each {words.each}{so_well}{words.as_if}"

    @property
    def _towards(self) -> float:
        """Direction in which delays grow, degrees."""
        return float(np.degrees(np.arctan2(self.later_s[-1], self.later_s[0])))


_BEGUN = "commands take effect at times that depend on "


def _ms(time_s: float) -> str:
    return f"{abs(1e3 * time_s):.2g}" if abs(time_s) < 0.01 else f"{abs(1e3 * time_s):.0f}"


@dataclass(frozen=True)
class Changes:
    """Changes of command, one a row: from ``command`` (n,) of a ``trial`` (n,) to the next; first seen in a ``frame`` (n,)."""

    trial: NDArray[np.int64]
    command: NDArray[np.int64]
    frame: NDArray[np.int64]


def delay_rule(tracks: Tracks, wheelbase_m: float, changes: Changes, late_s: Array) -> DelayRule | None:
    """What the delays ``late_s`` (n,) of changes of command follow; None where they follow nothing that is logged."""
    late_s = late_s - np.median(late_s)
    far_s = FAR * float(robust_sd(late_s))
    off = late_s.clip(-far_s, far_s)
    off = off - off.mean()
    tried = [(name, values - values.mean(axis=0)) for name, values in _variables(tracks, wheelbase_m, changes)]
    best: tuple[float, DelayRule] | None = None
    for name, values in tried:
        slopes = np.linalg.lstsq(values, off, rcond=None)[0]
        left = off - values @ slopes
        explained = 1.0 - float(left @ left) / max(float(off @ off), 1e-300)
        if explained < EXPLAINED or (best is not None and explained < best[0] + SIMPLER):
            continue
        scores: Array = np.stack([np.bincount(changes.trial, column * off, len(tracks)) for column in values.T], axis=1)
        if sign_flip_p(scores, values.T @ values) < CHANCE / len(tried):
            correlation = float(np.sqrt(explained)) * (float(np.sign(slopes[0])) if len(slopes) == 1 else 1.0)
            best = explained, DelayRule(name, tuple(float(s) for s in slopes), correlation, float(left.std()))
    return None if best is None else best[1]


def _variables(tracks: Tracks, wheelbase_m: float, changes: Changes) -> Iterator[tuple[str, Array]]:
    """Name and values (n, 1 or 2) of what is known of each change, the simplest first."""
    x_m, y_m, heading_rad = tracks.pose[changes.frame].T
    yield "x_m", x_m[:, None]
    yield "y_m", y_m[:, None]
    for k, when in enumerate(("before", "after")):
        at = changes.trial, changes.command + k
        left_m_s, right_m_s = tracks.left_m_s[at], tracks.right_m_s[at]
        speed_m_s = (left_m_s + right_m_s) / 2.0
        yield f"speed_{when}_m_s", speed_m_s[:, None]
        yield f"turn_{when}_rad_s", ((right_m_s - left_m_s) / wheelbase_m)[:, None]
        yield f"fast_{when}_m_s", np.abs(speed_m_s)[:, None]
    if tracks.start_known:
        yield "session_s", tracks.session_s[changes.frame][:, None]
    yield "time_in_trial_s", tracks.own_s[changes.frame][:, None]
    for name, values in tracks.extra.items():
        if np.isfinite(values[changes.frame]).all():
            yield name, values[changes.frame][:, None]
    yield "place", np.column_stack([x_m, y_m])
    yield "heading_rad", np.column_stack([np.cos(heading_rad), np.sin(heading_rad)])
