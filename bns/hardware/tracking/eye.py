"""A tracker looked through during a trial: fresh sights only, headings unwrapped, everything seen noted in the journal."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise

import numpy as np

from bns.errors import HardwareError, TrialPausedError
from bns.hardware.clock import Clock
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.tracking.sight import Sight, Tracker, unwrapped

SAME_M = 1e-5
"""A camera's noise alone moves what it sees by ten times that, and more."""
_FRESH_S = 0.1
_LOOKS, _BETWEEN_S = 10, 0.02
_AHEAD_S = 0.1
"""A stamp may be so far ahead of the clock: rounded, or of a camera's own clock."""
_STANDS_S, _SOON_S, _FEWEST = 0.4, 1.5, 4
"""A robot stands that is seen so long in one place; it may take so long to come to that."""
_STANDS_M, _STANDS_RAD = 0.008, 0.1
"""From the first half of that time to the second, medians of both: 4 cm/s, and more than a tracker's noise."""


def _wanders(sights: list[Sight]) -> bool:
    """Whether no two pictures show all points of a robot in the same places."""
    pictures = list({sight.t_s: np.concatenate([*sight.points.values(), sight.pose]) for sight in sights}.values())
    return len(pictures) > 1 and all(np.abs(a - b).max() > SAME_M for a, b in pairwise(pictures))


def _measured(sight: Sight) -> Sight:
    """The sight with numbers of our own; ValueError or TypeError unless it is a pose of three numbers, seen at a time."""
    pose = np.asarray(sight.pose, np.float64)
    points = {str(name): np.asarray(place, np.float64) for name, place in sight.points.items()}
    t_s, residual_m = float(sight.t_s), float(sight.residual_m)
    if pose.shape != (3,) or any(place.shape != (2,) for place in points.values()):
        raise ValueError(f"it gave {sight.pose!r}, which is no pose of x_m, y_m, heading_rad")
    if not all(np.isfinite(part).all() for part in (pose, np.array([t_s, residual_m]), *points.values())):
        raise ValueError(f"it gave the pose {pose.tolist()} at {t_s} s, which is no place; a robot that is not seen is None")
    return Sight(t_s, pose, residual_m, points)


def _changed(sights: list[Sight]) -> np.ndarray | None:
    """From the first half of the last `_STANDS_S` to the second, medians: x_m, y_m, heading_rad. None: seen too seldom."""
    if not sights:
        return None
    half_s = sights[-1].t_s - _STANDS_S / 2
    halves: list[list[np.ndarray]] = [[], []]
    for sight in sights:
        if sight.t_s >= half_s - _STANDS_S / 2:
            halves[sight.t_s >= half_s].append(sight.pose)
    if min(map(len, halves)) < _FEWEST / 2 or sights[0].t_s > half_s - 0.4 * _STANDS_S:
        return None
    before, after = (np.median(half, axis=0) for half in halves)
    return np.asarray(after - before)


def _stands(sights: list[Sight]) -> bool:
    change = _changed(sights)
    return change is not None and float(np.hypot(*change[:2])) < _STANDS_M and abs(float(change[2])) < _STANDS_RAD


class Eye:
    """`heading_rad` is where the robot looks first, give or take half a turn; sights are `delay_s` older than their stamps.

    `kind` is what messages call the tracker.
    """

    def __init__(
        self,
        tracker: Tracker,
        clock: Clock,
        journal: HardwareLog,
        heading_rad: float,
        delay_s: float = 0.0,
        kind: str = "",
    ) -> None:
        self._tracker, self._clock, self._journal, self._delay_s = tracker, clock, journal, delay_s
        self._called = f"the {kind} tracker" if kind else "the tracker"
        self._heading_rad, self._newest_s, self._broken = heading_rad, -1.0, False
        self.wanders = False
        """Whether a robot that stands is seen in another place in every picture, if only by a hundredth of a millimetre."""
        if facts := getattr(tracker, "facts", None):  # of a camera: how it takes its pictures
            journal.note("tracker", **facts)

    @property
    def picture_s(self) -> float | None:
        """When the newest picture came, seen or not; None of a tracker that does not tell."""
        try:
            return getattr(self._tracker, "picture_s", None)
        except Exception as error:
            raise self._failed(error) from error

    def _failed(self, error: Exception) -> TrialPausedError:
        """What is raised of whatever goes wrong in a tracker, ours or somebody else's: the robot is stopped, the trial pauses."""
        self._broken = True
        if isinstance(error, TrialPausedError):
            return error
        if isinstance(error, HardwareError):
            return TrialPausedError(f"{self._called}: {error}")
        said = f"{type(error).__name__}: {error}"
        return TrialPausedError(f"{self._called} failed ({said}). Repair that, and see that bns track shows the robot")

    def look(self) -> Sight | None:
        """A sight newer than the last, with the time at which it was filmed; None if there is none.

        TrialPausedError if the tracker's device is gone, if it fails in any other way, or if what it gives is no finite pose, or
        one that is yet to come: a stamp ahead of the clock would pass for new for as long as it is.
        """
        try:
            found = self._tracker.look()
            sight = None if found is None else _measured(found)
        except Exception as error:
            raise self._failed(error) from error
        if sight is not None and sight.t_s > self._clock.now_s() + _AHEAD_S:
            raise TrialPausedError(
                f"{self._called} gave a pose that is stamped {sight.t_s - self._clock.now_s():.3g} s ahead of the clock. The t_s "
                "of a sight is a time of the clock that the tracker was opened with (clock.now_s()): when the pose was seen, or "
                "came. It is no time of day, and not the sender's"
            )
        if sight is None or (sight.t_s <= self._newest_s and self._clock.now_s() > sight.t_s + _FRESH_S):
            return None
        self._newest_s = sight.t_s
        self._heading_rad = unwrapped(float(sight.pose[2]), self._heading_rad)
        pose = np.array([sight.pose[0], sight.pose[1], self._heading_rad])
        points = {name: [round(float(v), 5) for v in place] for name, place in sight.points.items()}
        filmed_s, rounded = sight.t_s - self._delay_s, [round(float(v), 5) for v in pose]
        residual_m = round(sight.residual_m, 6)
        self._journal.note("seen", pose=rounded, residual_m=residual_m, points=points, filmed_s=round(filmed_s, 6))
        return Sight(filmed_s, pose, sight.residual_m, sight.points)

    def standing(self, meanwhile: Callable[[], None] = lambda: None) -> Sight | None:
        """Mean of some looks, from now on, at a robot that stands; None if it is not seen often enough.

        `meanwhile` is called after each look; what it raises ends the looking. TrialPausedError of a tracker that is `gone`.
        """
        sights: list[Sight] = []
        began_s = self._clock.now_s()
        for _ in range(5 * _LOOKS):
            sight = self.look()
            meanwhile()
            if sight is not None and sight.t_s >= began_s:  # an older one may be from before it was put there
                sights.append(sight)
            if len(sights) == _LOOKS:
                self.wanders = _wanders(sights)
                points = {name: np.mean([s.points[name] for s in sights], axis=0) for name in sight.points} if sight else {}
                return Sight(sights[-1].t_s, np.mean([s.pose for s in sights], axis=0), sights[-1].residual_m, points)
            self._clock.sleep(_BETWEEN_S)
        if gone := str(getattr(self._tracker, "gone", "")):
            raise self._failed(HardwareError(gone))
        return None

    def moving(self) -> str:
        """How a robot moves that should stand, in a clause; "" if it is seen to stand, or not seen often enough. Never raises."""
        sights: list[Sight] = []
        began_s = self._clock.now_s()
        with suppress(TrialPausedError):
            while not self._broken and self._clock.now_s() - began_s < _SOON_S:
                sight = self.look()
                if sight is not None and sight.t_s >= began_s and (not sights or sight.t_s > sights[-1].t_s):
                    sights.append(sight)
                if _stands(sights):
                    return ""
                self._clock.sleep(_BETWEEN_S)
            change = _changed(sights)
            if change is not None:
                speed_m_s, turn_rad_s = np.hypot(*change[:2]) / (_STANDS_S / 2), abs(change[2]) / (_STANDS_S / 2)
                return f"{self._called} sees it move at {speed_m_s:.2f} m/s and turn at {np.degrees(turn_rad_s):.0f}°/s"
        return ""

    def close(self) -> None:
        """Give the tracker's device free. The robot stands by now: a tracker that fails here takes nothing away."""
        with suppress(Exception):
            self._tracker.close()
