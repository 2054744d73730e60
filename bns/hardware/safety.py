"""When a drive must end, and that it ends with a robot that was seen to stand still."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from types import FrameType
from typing import Any, Self

from bns.errors import StopNotConfirmedError, TrialPausedError
from bns.hardware.clock import Clock
from bns.hardware.stop import Stop
from bns.hardware.tracking.sight import Sight

CUT_THE_POWER = "THE ROBOT MAY STILL BE MOVING: CUT THE POWER NOW."


class DriveEnded(Exception):  # noqa: N818  # no error: the robot is stopped, what it did until then counts
    """The drive is over before its commands are; the message says why. The trial goes on."""


class OutOfSight(DriveEnded):
    """The tracker does not see the robot any more."""


@dataclass(frozen=True)
class Surface:
    """The part of the floor that the robot may be on, m, in the world frame."""

    x_low_m: float
    x_high_m: float
    y_low_m: float
    y_high_m: float

    def holds(self, x_m: float, y_m: float) -> bool:
        """Whether a point lies on it."""
        return self.x_low_m <= x_m <= self.x_high_m and self.y_low_m <= y_m <= self.y_high_m


@dataclass(frozen=True)
class Limits:
    """What a drive must keep: the surface, how long the robot may be out of sight, how late a look may come, and how long the
    guard of its port may hear nothing from the trial.

    No new picture for `picture_s` stops the robot; poses that do not follow the orders for `disagree_s` pause the trial.
    After a trial that is gone, its guard tries to stop the robot until that has not answered for `gives_up_s`: four hours, in
    which the battery of a robot that drives should be empty.
    """

    surface: Surface
    lost_s: float = 0.5
    picture_s: float = 0.25
    disagree_s: float = 0.5
    late_s: float = 1.0
    silent_s: float = 0.3
    gives_up_s: float = 4 * 3600.0


_OVERDUE_S = 0.005


class Watch:
    """Judges every look at a driving robot; raises what ends the drive."""

    def __init__(self, limits: Limits, clock: Clock, stopping: Stopping) -> None:
        self._limits, self._clock, self._stopping = limits, clock, stopping
        self.begin()

    def begin(self) -> None:
        """A drive begins: the robot has just been seen."""
        self._began_s = self._seen_s = self._looked_s = self._clock.now_s()

    def check(self, sight: Sight | None, picture_s: float | None = None) -> None:
        """DriveEnded or TrialPausedError if the drive must not go on; `picture_s`: when the newest picture came, if known."""
        now_s = self._in_time()
        if sight is not None:
            self._seen_s = max(self._seen_s, min(sight.t_s, now_s))
            x_m, y_m = float(sight.pose[0]), float(sight.pose[1])
            if not self._limits.surface.holds(x_m, y_m):
                raise DriveEnded(f"the robot left the surface at ({x_m:.2f}, {y_m:.2f}) m")
        self._check_picture(now_s, picture_s)
        if now_s - self._seen_s > self._limits.lost_s:
            raise OutOfSight(f"the tracker has not seen the robot for {now_s - self._seen_s:.1f} s")

    def next_look_s(self, tick_s: float, picture_s: float | None) -> float:
        """How long until the next look: `tick_s`, or until the newest picture has to have been followed by another, if sooner."""
        if picture_s is None:
            return tick_s
        left_s = max(picture_s, self._began_s) + self._limits.picture_s - self._clock.now_s()
        return min(tick_s, max(left_s, 0.0) + _OVERDUE_S)

    def overdue(self, picture_s: float) -> bool:
        """Whether a picture that came then should have been followed by another by now."""
        return self._clock.now_s() - max(picture_s, self._began_s) > self._limits.picture_s

    def still_filmed(self, picture_s: float | None) -> None:
        """The part of `check` that concerns a robot which stands and may be out of sight: somebody looks, new pictures come."""
        self._check_picture(self._in_time(), picture_s)

    def _in_time(self) -> float:
        """Now; TrialPausedError if a stop was asked for, or the last look was too long ago."""
        now_s = self._clock.now_s()
        self._stopping.check()
        late_s, self._looked_s = now_s - self._looked_s, now_s
        if late_s > self._limits.late_s:
            raise TrialPausedError(
                f"the program did not check the robot for {late_s:.1f} s: the computer is too busy, or the robot is too slow. "
                "End other programs, bring the robot nearer, or allow more late_s in the rig."
            )
        return now_s

    def _check_picture(self, now_s: float, picture_s: float | None) -> None:
        if picture_s is not None and now_s - max(picture_s, self._began_s) > self._limits.picture_s:
            raise DriveEnded(f"the camera has sent no new picture for {now_s - picture_s:.2f} s")


_SIGNALS = {
    number: called
    for name, called in {
        "SIGINT": "interrupted",
        "SIGTERM": "terminated",
        "SIGHUP": "the terminal was closed",
        "SIGQUIT": "quit",
        "SIGTSTP": "suspended",
    }.items()
    if (number := getattr(signal, name, None)) is not None  # Windows has the first two
}
"""What ends a trial from outside, and how that is called."""


def _by_nohup(number: signal.Signals) -> bool:
    """Whether whoever began the trial has it outlive its terminal."""
    return number.name == "SIGHUP" and signal.getsignal(number) is signal.SIG_IGN


class Stopping:
    """Signals, noted while it is open and acted on at the next look; the robot is stopped before anything else ends.

    Ctrl-Z suspends the process once the robot stands and its port is free; a trial that goes on after that is paused.
    In a thread other than the main one no signal arrives and nothing is taken over; `request` works from anywhere.
    """

    def __init__(self) -> None:
        self.reason: str | None = None
        self.causes: list[Callable[[], str | None]] = []
        """Further reasons to stop, asked for at every look."""
        self.alarms: list[Callable[[], None]] = []
        """Called at once when a signal comes."""
        self._asking = self._suspended = False
        self._former: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            self._former = {n: signal.signal(n, self._handle) for n in _SIGNALS if not _by_nohup(n)}
        return self

    def __exit__(self, *_error: object) -> None:
        for number, handler in self._former.items():
            signal.signal(number, handler)
        if self._suspended:
            self._suspended = False
            os.kill(os.getpid(), signal.SIGTSTP)

    def request(self, reason: str) -> None:
        """Stop at the next look."""
        self.reason = self.reason or reason

    def check(self) -> None:
        """TrialPausedError if a stop was asked for."""
        for cause in self.causes:
            found = cause()  # a signal that comes meanwhile is the first reason
            if found is not None:
                self.request(found)
        if self.reason is not None:
            raise TrialPausedError(self.reason)

    def ask(self, question: str) -> str:
        """`input`, which a signal ends at once: while somebody is asked, the robot stands."""
        self._asking = True
        try:
            return input(question)
        finally:
            self._asking = False

    def _handle(self, number: int, _frame: FrameType | None) -> None:
        self.request(_SIGNALS[signal.Signals(number)])
        self._suspended |= _SIGNALS[signal.Signals(number)] == "suspended"
        for alarm in self.alarms:
            alarm()
        if self._asking:
            raise KeyboardInterrupt


class StopsAtTheEnd:
    """Whatever happens inside, the robot is stopped when it is left, and StopNotConfirmedError raised if it may still move.

    The fault inside stays attached as the cause. A stop that is not confirmed is said on stderr at once. `stop` must never raise.
    ``asked``: why somebody asked for a stop, if anybody did: then the guard may have taken the port, which looks like a fault.
    """

    def __init__(self, stop: Callable[[], Stop], asked: Callable[[], str | None] = lambda: None) -> None:
        self._stop, self._asked = stop, asked
        self.last: Stop | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _kind: type[BaseException] | None, error: BaseException | None, _trace: object) -> None:
        self.last = self._stop()
        if not self.last.confirmed:
            if isinstance(error, StopNotConfirmedError):
                return  # said already, and this attempt changes nothing
            with suppress(OSError, ValueError):  # of a terminal that is gone
                print(f"bns: {CUT_THE_POWER}", file=sys.stderr, flush=True)  # at once: closing the rig takes seconds more
            reason = self._asked() or error
            why = f" It was being stopped because {reason}." if reason is not None else ""
            raise StopNotConfirmedError(
                f"{CUT_THE_POWER} It did not confirm a stop for {self.last.seconds:.1f} s: {self.last.problem}.{why}"
            ) from error
