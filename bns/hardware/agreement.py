"""Whether the robot that is seen is the one that is driven: poses against orders and the wheels' own speeds.

A picture that stands still under a running clock, a tracker that follows something else, a marker that points another way, wheels
that do not turn, a robot that is carried: all of them leave poses that come in time and are wrong. The limits are wide: a robot
that slips, pulls to a side or is slower than ordered by a third is one to be diagnosed, not to be stopped.
"""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bns.errors import TrialPausedError
from bns.hardware.tracking.sight import Sight

STILL_M = 0.003
"""A picture in which no point of the robot moves so far shows the same scene."""
_NOSE_M = 0.05
_FROZEN_WAY_M, _FROZEN_S = 0.02, 0.1
"""Way of the faster wheel in that time, and how long that is at least: a robot that drives it has moved, or turned, by six times
`STILL_M`; a fast one by ten times, as its camera may be late."""
_SUSPECT_M = 0.007
"""After so much of that way, a picture that shows none of it is looked at more often."""
_WINDOW_S = 2.0
_SHARE, _OFF_M, _OFF_RAD = 0.5, 0.04, 0.6
"""Seen and expected motion may differ by half of the way (or turn), and this: a fifth of a second at full speed."""
_WHEELS_APART = 0.3
"""One wheel may turn by so much of its way more than the other."""
_REACTS_S = 0.2
"""Orders take effect so much later at most: link, motors."""
_WHEEL_SHARE, _WHEEL_OFF_M_S = 0.5, 0.02


class SameScene:
    """Whether points that should move do: how much motion was made since they were last seen to move."""

    def __init__(self, still_m: float = STILL_M) -> None:
        self._still_m = still_m
        self._points: np.ndarray | None = None
        self._made = 0.0

    def is_another(self, points: np.ndarray) -> bool:
        """Whether `points` (n, 2), m, are seen elsewhere than in the scene so far, or are the first; then this is the scene."""
        other = self._points is None or bool(np.hypot(*(points - self._points).T).max() > self._still_m)
        self._points = points if other else self._points
        return other

    def since_it_moved(self, points: np.ndarray, made: float) -> float:
        """The part of the motion `made` so far, by the robot's account, of which nothing is seen at `points` (n, 2), m."""
        if self.is_another(points):
            self._made = made
        return made - self._made


class _Seen(NamedTuple):
    t_s: float
    pose: np.ndarray


class Agreement:
    """Of a robot on two wheels. What is seen may differ from what was ordered for `disagree_s`, then the trial pauses."""

    def __init__(self, disagree_s: float, wheelbase_m: float) -> None:
        self._disagree_s, self.wheelbase_m = disagree_s, wheelbase_m
        self._orders: list[tuple[float, float, float]] = []
        self._seen: deque[_Seen] = deque()
        self._scene = SameScene()
        self._since_s: float | None = None
        self._wheels_off = 0
        self.suspects = False
        """Whether the robot should have been seen to move and was not, for less than what pauses the trial."""

    @property
    def doubts_wheels(self) -> bool:
        """Whether the wheels have just told other speeds than were ordered, for the first time."""
        return self._wheels_off > 0

    def ordered(self, t_s: float, left_m_s: float, right_m_s: float) -> None:
        """Speeds of the wheels from now on."""
        self._orders.append((t_s + _REACTS_S, left_m_s, right_m_s))
        self._wheels_off = 0

    def measured(self, t_s: float, left_m_s: float, right_m_s: float) -> None:
        """What the wheels say of themselves; TrialPausedError if that is not what was ordered, twice in a row."""
        since_s, *ordered = self._orders[-1]
        if t_s < since_s + _REACTS_S:  # they are still getting there
            return
        pairs = list(zip(ordered, (left_m_s, right_m_s), strict=True))
        off = any(abs(is_m_s - asked) > _WHEEL_OFF_M_S + _WHEEL_SHARE * abs(asked) for asked, is_m_s in pairs)
        self._wheels_off = self._wheels_off + 1 if off else 0
        if self._wheels_off > 1:
            left, right = (f"{is_m_s:.3f} m/s for {asked:.3f}" for asked, is_m_s in pairs)
            raise TrialPausedError(f"the wheels do not turn as commanded (left {left}, right {right}); is one blocked?")

    def seen(self, sight: Sight) -> None:
        """A pose; TrialPausedError if it has not followed the orders for too long."""
        if not self._orders or (self._seen and sight.t_s <= self._seen[-1].t_s):
            return
        nose = _NOSE_M * np.array([math.cos(sight.pose[2]), math.sin(sight.pose[2])])
        way_m = self._scene.since_it_moved(np.array([sight.pose[:2] + nose, sight.pose[:2] - nose]), self._way_m(sight.t_s))
        self.suspects = way_m > _SUSPECT_M
        if way_m > max(_FROZEN_WAY_M, _FROZEN_S * max(abs(speed) for speed in self._orders[-1][1:])):
            raise TrialPausedError(
                f"the robot was commanded to drive {100 * way_m:.0f} cm, but the picture shows no motion: the camera hangs or "
                "shows another scene, or the robot is held. Look at it: bns track"
            )
        self._seen.append(_Seen(sight.t_s, sight.pose))
        while self._seen[0].t_s < sight.t_s - _WINDOW_S:
            self._seen.popleft()
        why = self._disagreement()
        self._since_s = (self._since_s or sight.t_s) if why else None
        if self._since_s is not None and sight.t_s - self._since_s >= self._disagree_s:
            raise TrialPausedError(
                f"{why}. Is another thing tracked, is the marker turned on the robot, was it carried? Try: bns track"
            )

    def _disagreement(self) -> str:
        """How the motion seen since the begin of the window differs from the one ordered, or nothing."""
        first, last = self._seen[0], self._seen[-1]
        expected, way_m, turn_rad = self._driven(first, last.t_s)
        off_m = float(np.hypot(*(expected[:2] - last.pose[:2])))
        if off_m > _OFF_M + _SHARE * way_m:
            return f"the robot is seen {100 * off_m:.0f} cm from where its commands lead in {last.t_s - first.t_s:.1f} s"
        off_rad = abs(math.remainder(expected[2] - last.pose[2], 2.0 * math.pi))
        if off_rad > _OFF_RAD + max(_SHARE * turn_rad, _WHEELS_APART * way_m / self.wheelbase_m):
            return f"the robot is seen turned {math.degrees(off_rad):.0f}° from where its commands lead"
        return ""

    def _spans(self, from_s: float, to_s: float) -> list[tuple[float, float, float]]:
        """How long which speeds were in force."""
        ends = [*(t_s for t_s, _, _ in self._orders[1:]), math.inf]
        found = []
        for (begin_s, left, right), end_s in zip(self._orders, ends, strict=True):
            lasts_s = min(end_s, to_s) - max(begin_s, from_s)
            if lasts_s > 0.0:
                found.append((lasts_s, left, right))
        return found

    def _way_m(self, until_s: float) -> float:
        """Of the faster wheel, so far. While a robot turns back, nobody knows when, it is where it was, and makes none."""
        way_m = sum(lasts_s * max(abs(left), abs(right)) for lasts_s, left, right in self._spans(-math.inf, until_s))
        for (since_s, *before), (back_s, *after) in pairwise(self._orders):
            if before[0] * after[0] + before[1] * after[1] < 0.0:
                lasts_s = min(back_s, until_s) - max(back_s - _REACTS_S, since_s)
                way_m -= max(lasts_s, 0.0) * max(abs(speed) for speed in before)
        return way_m

    def _driven(self, begin: _Seen, to_s: float) -> tuple[np.ndarray, float, float]:
        """Where the orders lead from a pose, in arcs; the way of the middle, and how much it turns."""
        x_m, y_m, heading_rad = (float(v) for v in begin.pose)
        way_m = turned_rad = 0.0
        for lasts_s, left, right in self._spans(begin.t_s, to_s):
            ahead_m, turn_rad = lasts_s * (left + right) / 2.0, lasts_s * (right - left) / self.wheelbase_m
            chord_m = ahead_m * float(np.sinc(turn_rad / (2.0 * math.pi)))
            x_m += chord_m * math.cos(heading_rad + turn_rad / 2.0)
            y_m += chord_m * math.sin(heading_rad + turn_rad / 2.0)
            heading_rad += turn_rad
            way_m, turned_rad = way_m + abs(ahead_m), turned_rad + abs(turn_rad)
        return np.array([x_m, y_m, heading_rad]), way_m, turned_rad
