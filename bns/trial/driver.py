"""Robot, operator and hardware log brought together: one evaluation after the other, whatever happens in between."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bns.errors import BnsError, TrialPausedError
from bns.hardware.clock import Clock
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.platform import Driven, Platform
from bns.hardware.rig import Rig, surface_text
from bns.robots import load_robot
from bns.trial.evaluation import Evaluation
from bns.trial.operator import Decision, Operator
from bns.trial.picture import draw_drive
from bns.trial.underway import Underway

_MOST_VOID = 3
"""So many drives without a single finished command, one after the other, and the trial pauses."""


REPEATED = "repeat-"
"""Before the kinds of events of a controller that is driven once more: they are no evaluation."""


Stuck = tuple[str, tuple[tuple[str, int], ...], str]
"""A drive that could not go on, as in the journal: before the kind of event, its numbers, what was stuck."""


def leaps_text(count: int, cycles: bool = False) -> str:
    """That so many poses cannot be, and what to look for; nothing if there are none. ``cycles``: the robot moves in such."""
    if not count:
        return ""
    which = "1 pose is" if count == 1 else f"{count} poses are"
    cannot = "further from the one before than the robot can drive, or turned further than it can turn"
    then = "; cycles with such poses count as unstable" if cycles else ""
    return f"{which} {cannot} (a false marker, a push?){then}; bns track shows what is seen"


@dataclass(frozen=True)
class _Purpose:
    """What a drive is for: in kinds of events, in text, and in numbers of events."""

    prefix: str
    text: str
    numbers: Mapping[str, int]


class TrialDriver:
    """Implements `bns.trial.background.RobotDriver`.

    `start` (3,) is where the task, or the next drive, begins; `stuck` are drives of earlier attempts that could not go on.
    """

    def __init__(
        self,
        platform: Platform,
        operator: Operator,
        rig: Rig,
        start: np.ndarray,
        clock: Clock,
        log: HardwareLog,
        picture: Path | None = None,
        goals_m: np.ndarray | None = None,
        stuck: Iterable[Stuck] = (),
    ) -> None:
        self._platform, self._operator, self._rig, self.start = platform, operator, rig, start
        self._clock, self._log = clock, log
        self._began_s = clock.now_s()
        self._first, self._armed = True, False
        self._picture, self._robot = picture, load_robot(rig.robot)
        self.underway = Underway(clock, goals_m)
        """What goes on at this moment, for a screen."""
        log.listeners.append(self.underway.heard)
        self.suspended: Callable[[], AbstractContextManager[None]] = nullcontext
        """Entered while somebody is asked: a live view leaves the terminal alone."""
        self._stuck = set(stuck)
        self.placing_s = 0.0
        self.readings: dict[str, float] = {}
        self.stops_s: list[float] = []
        self.ends: list[str] = []
        self._last_end = ""
        self._told = set[str]()
        self.leaps = 0
        """Poses of all drives that the robot cannot have reached."""
        self.marked: int | None = None
        """How many commands were called unstable in the last evaluation; None for a robot whose commands cannot be."""

    def evaluate(self, number: int, controller: np.ndarray) -> Evaluation:
        """Drive a controller until there is an evaluation to keep."""
        return self._kept(_Purpose("", f"evaluation {number}", {"evaluation": number}), controller)

    def repeat(self, number: int, again: int, controller: np.ndarray) -> Evaluation:
        """Drive the controller of an evaluation once more, for the `again`-th time (2, 3, ...), until it is to be kept."""
        numbers = {"evaluation": number, "repeat": again}
        return self._kept(
            _Purpose(REPEATED, f"drive {again} of the controller of evaluation {number}", numbers), controller
        )

    def _kept(self, purpose: _Purpose, controller: np.ndarray) -> Evaluation:
        void = 0
        while True:
            self._ready(void)
            self._arm(purpose, controller)
            driven = self._drive(purpose, controller)
            if driven.stuck and self._stuck_anew(purpose, driven.stuck):
                self._note(purpose, "discarded", why=driven.ended)
                self._log.sync()
                self._operator.place(self.start, driven.ended)
                continue
            if not len(driven.commands):
                void += 1
                self._note(purpose, "discarded", why=driven.ended)
                if void == _MOST_VOID:
                    raise TrialPausedError(f"{void} drives in a row ended before a command was over: {driven.ended}")
                continue
            try:
                decision = self._asked(purpose.text, controller, driven)
            except TrialPausedError:
                self._note(purpose, "discarded", why="paused")
                self._log.sync()
                raise
            if decision.answer == "next":
                self.marked = len(decision.unstable) if driven.spans_s else None
                if decision.unstable:
                    self._note(purpose, "marked", unstable=decision.unstable)
                    self._log.sync()
                return Evaluation(controller, driven.commands, driven.poses, unstable=decision.unstable)
            self._note(purpose, "discarded", why=decision.answer)
            if decision.answer == "skip":
                return Evaluation(controller, driven.commands[:0], driven.poses[:0], skipped=True)

    def _stuck_anew(self, purpose: _Purpose, what: str) -> bool:
        """Whether a controller was stuck there for the first time. At the second it is the controller's: what it did is kept."""
        cause = (purpose.prefix, tuple(purpose.numbers.items()), what)
        if cause in self._stuck:
            return False
        self._stuck.add(cause)
        self._note(purpose, "stuck", what=what)
        return True

    def evaluated(self, number: int, rounds: int, row: Mapping[str, Any]) -> None:
        """Note it, durably."""
        fitness = {name: row[name] for name in ("evaluated_fitness_world", "evaluated_goals_reached")}
        self._log.note("evaluated", evaluation=number, rounds=rounds, **fitness)
        self._log.sync()

    def skipped(self, number: int, controller: np.ndarray, rounds: int, again: int | None = None) -> None:
        """Note that an evaluation, or its `again`-th drive, was passed over: it is not driven when the trial is gone on with."""
        prefix, numbers = ("", {}) if again is None else (REPEATED, {"repeat": again})
        self._log.note(prefix + "skipped", evaluation=number, **numbers, picked=controller.tolist(), rounds=rounds)
        self._log.sync()

    def live_text(self) -> dict[str, str]:
        """What a live view shows of robot and rig: heading -> text."""
        units = {"v": "V", "c": "°C"}
        shown = {}
        for name, value in self.readings.items():
            what, _, unit = name.rpartition("_")
            shown[what.replace("_", " ")] = f"{value:.1f} {units.get(unit, unit)}"
        if self.marked is not None:
            shown["unstable cycles"] = str(self.marked)
        if self.stops_s:
            shown["last stop"] = f"{1000 * self.stops_s[-1]:.0f} ms"
        return shown | {"ended early": str(len(self.ends))}

    def _note(self, purpose: _Purpose, kind: str, **what: Any) -> None:
        self._log.note(purpose.prefix + kind, **purpose.numbers, **what)

    def _drive(self, purpose: _Purpose, controller: np.ndarray) -> Driven:
        self.readings = self._platform.readings()
        session_s = self._clock.now_s() - self._began_s
        self.underway.begins(len(controller), self._lasts_s(controller), self.readings)
        try:
            driven = self._platform.drive(controller)
        except BaseException as why:
            with suppress(OSError, BnsError):  # a journal that cannot be written is told of by the drive itself
                self._note(purpose, "interrupted", why=str(why) or type(why).__name__)
                self._log.sync()
            raise
        finally:
            self.underway.ends()
        self.stops_s.append(driven.stop.seconds)
        self._last_end = driven.ended
        if driven.ended:
            self.ends.append(driven.ended)
        if driven.note and driven.note not in self._told:
            self._told.add(driven.note)
            with self.suspended():
                print(f"{purpose.text}: {driven.note}", file=sys.stderr)
        if driven.leaps:
            self.leaps += driven.leaps
            with self.suspended():
                print(f"{purpose.text}: {leaps_text(driven.leaps, bool(driven.spans_s))}", file=sys.stderr)
        self._note(
            purpose,
            "driven",
            picked=controller.tolist(),
            commands=driven.commands.tolist(),
            poses=driven.poses.tolist(),
            rows=[{name: None if math.isnan(v) else v for name, v in row.items()} for row in driven.rows],
            ended=driven.ended,
            session_s=session_s,
            readings=self.readings,
            leaps=driven.leaps,
        )
        self._log.sync()
        return driven

    def _lasts_s(self, controller: np.ndarray) -> float:
        here = getattr(self._platform, "lasts_s", None)  # a platform of another package may not say
        return float(here(controller) if here is not None else self._robot.driven_ms(controller) / 1000.0)

    def _arm(self, purpose: _Purpose, controller: np.ndarray) -> None:
        """Before the first drive of a session somebody agrees, and has time to step back."""
        if self._armed:
            return
        began = time.perf_counter()
        what = f"{purpose.text}: the robot will drive {len(controller)} commands in about {self._lasts_s(controller):.0f} s"
        with self.suspended():
            self._operator.arm(f"{what}, {surface_text(self._rig.limits.surface)}.")
        self._armed = True
        self.placing_s += time.perf_counter() - began

    def _shown(self) -> str:
        """What was driven: drawn in letters, and as a picture beside the journal."""
        if not self._operator.wants_picture:
            return ""
        sketch = self.underway.sketch()
        if self._picture is not None and self.underway.path:
            with suppress(OSError):  # a full disk costs the picture alone
                draw_drive(self.underway.path, self.underway.goals_m, self._rig.limits.surface, self._picture)
                sketch += f"\n(as a picture: {self._picture})"
        return f"{sketch}\n" if sketch else ""

    def _asked(self, text: str, controller: np.ndarray, driven: Driven) -> Decision:
        began = time.perf_counter()
        part = f"{len(driven.commands)} of {len(controller)} commands" + (f" ({driven.ended})" if driven.ended else "")
        with self.suspended():
            decision = self._operator.accept(f"{self._shown()}{text}: {part} in {driven.seconds:.0f} s", driven.spans_s)
        self.placing_s += time.perf_counter() - began
        return decision

    def _ready(self, void: int) -> None:
        """See that the robot stands near enough to its start."""
        began = time.perf_counter()
        requests = 0
        while (why := self._misplaced(void)) is not None:
            if requests == _MOST_VOID:
                raise TrialPausedError(f"the robot could not be brought to its start: {why}")
            self._log.note("placing", why=why)
            with self.suspended():
                self._operator.place(self.start, why)
            requests, void, self._first = requests + 1, 0, False
        self.placing_s += time.perf_counter() - began

    def _misplaced(self, void: int) -> str | None:
        pose = self._platform.pose()
        last = f" (the last drive ended because {self._last_end})" if self._last_end else ""
        if pose is None:
            return f"The tracker does not see the robot{last}"
        off_m = float(np.hypot(*(pose[:2] - self.start[:2])))
        if off_m > self._rig.placed_within_m:
            return f"The robot stands {100 * off_m:.0f} cm from its start{last}"
        off_rad = abs(math.remainder(pose[2] - self.start[2], 2.0 * math.pi))
        if off_rad > self._rig.placed_within_rad:
            return f"The robot is turned by {math.degrees(off_rad):.0f}° from its start{last}"
        return f"The drive gave no result{f': {self._last_end}' if self._last_end else ''}" if void else None
