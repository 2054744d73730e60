"""A robot as the driver of the loop: training and evolution go on in the background while it drives, as in the dissertation.

How many rounds of training and evolution fit into a drive depends on the machine; the number is noted with the drive. So
a trial repeats what was driven already, round by round, and goes on from there, to the same numbers.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Protocol, Self

import numpy as np

from bns.bootstrap.driver import Drive
from bns.errors import HardwareError
from bns.robots.base import Robot
from bns.trial.evaluation import Evaluation
from bns.worlds.robot import in_task_frame

Work = Callable[[], None]


class RobotDriver(Protocol):
    """Who has the robot."""

    def evaluate(self, number: int, controller: np.ndarray) -> Evaluation:
        """Drive a controller (n, components). Called in the thread that signals arrive in."""

    def evaluated(self, number: int, rounds: int, row: Mapping[str, Any]) -> None:
        """An evaluation is complete."""

    def skipped(self, number: int, controller: np.ndarray, rounds: int) -> None:
        """An evaluation was passed over."""


class BackgroundDriver:
    """Implements `bns.bootstrap.driver.Driver`.

    `past` are evaluations driven before, which are repeated without the robot; `most_rounds` bounds what goes on during
    one drive. With `until_success` it has finished when so many controllers in a row have succeeded on the robot.
    """

    def __init__(
        self,
        robot: Robot,
        robot_driver: RobotDriver,
        past: Sequence[Evaluation],
        most_rounds: int,
        until_success: int | None = None,
    ) -> None:
        self._robot, self._robot_driver, self._past = robot, robot_driver, past
        self._until_success, self._successes = until_success, 0
        self._rounds = Rounds(most_rounds)
        self._waiting = Waiting()
        self.rounds = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._rounds.close()

    @property
    def finished(self) -> bool:
        """Whether enough controllers in a row have succeeded."""
        return self._successes == self._until_success

    @property
    def waited_share(self) -> float:
        """Share of the time (by the computer's clock) since the first drive that the robot waited for computations."""
        return self._waiting.share(self._waiting.waited_s)

    @property
    def worked_share(self) -> float:
        """Share of the same time in which training and evolution went on."""
        return min(self._waiting.share(self._rounds.worked_s), 1.0)  # the last round goes on after the last drive

    def drive(self, evaluation: int, controller: np.ndarray, advance: Work) -> Drive:
        """Drive a controller, or take what was driven in the past, with the rounds that went with it.

        HardwareError if the past drove another controller.
        """
        if evaluation <= len(self._past):
            done, rounds = self._repeated(evaluation, controller, advance)
        else:
            done, rounds = self._driven(evaluation, controller, advance)
        self.rounds += rounds
        if done.skipped:
            if evaluation > len(self._past):
                self._robot_driver.skipped(evaluation, controller, rounds)
            return Drive(done.commands, done.poses, rounds, skipped=True)
        poses = in_task_frame(self._robot, done.poses)
        if self._robot.marks_unstable:
            poses = self._robot.marked_unstable(poses, done.unstable)
        return Drive(done.commands, poses, rounds)

    def evaluated(self, evaluation: int, drive: Drive, row: Mapping[str, Any]) -> None:
        """Have it noted; count successes in a row."""
        self._robot_driver.evaluated(evaluation, drive.rounds, row)
        self._successes = self._successes + 1 if row["evaluated_success"] else 0

    def _repeated(self, number: int, controller: np.ndarray, advance: Work) -> tuple[Evaluation, int]:
        done = self._past[number - 1]
        if done.picked.shape != controller.shape or not np.allclose(done.picked, controller, rtol=1e-5):
            raise HardwareError(
                f"evaluation {number} of the journal drove another controller than this bns picks: it was made with another "
                "version or other parameters. Take the bns it names, or begin a new trial with another --seed."
            )
        rounds = done.rounds or 1
        for _ in range(rounds):
            advance()
        return done, rounds

    def _driven(self, number: int, controller: np.ndarray, advance: Work) -> tuple[Evaluation, int]:
        self._waiting.ends()
        done, rounds = self._rounds.while_driving(lambda: self._robot_driver.evaluate(number, controller), advance)
        self._waiting.begins(self._rounds.waited_s)
        return done, rounds


class Rounds:
    """Repeats one round of work in a thread until it is told that it is enough; whole rounds only, so that they can be repeated.

    `waited_s`: how long the robot stood waiting for the last round of the last drive, by the computer's clock; `worked_s`: how
    long all work took so far.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._pool = ThreadPoolExecutor(1, "training")
        self._enough = threading.Event()
        self.waited_s = self.worked_s = 0.0

    def close(self) -> None:
        """End the thread, after its round."""
        self._enough.set()
        self._pool.shutdown()

    def while_driving(self, drive: Callable[[], Evaluation], work: Work) -> tuple[Evaluation, int]:
        """Drive here and go on with rounds there; what was driven, and how many rounds were done, one at least.

        A fault of the work is raised after the drive.
        """
        self._enough.clear()
        repeated = self._pool.submit(self._repeat, work)
        try:
            done = drive()
        finally:
            self._enough.set()
        began = time.perf_counter()
        count = repeated.result()
        self.waited_s = time.perf_counter() - began
        return done, count

    def _repeat(self, work: Work) -> int:
        count = 0
        while count == 0 or (count < self._most and not self._enough.is_set()):
            began_s = time.perf_counter()
            work()
            self.worked_s += time.perf_counter() - began_s
            count += 1
        return count


class Waiting:
    """Adds up, from the first drive on, how long a robot stands while something is computed."""

    def __init__(self) -> None:
        self._began_s: float | None = None
        self._stands_since_s = self.waited_s = 0.0

    def ends(self) -> None:
        """The robot is driven again."""
        now_s = time.perf_counter()
        if self._began_s is None:
            self._began_s = self._stands_since_s = now_s
        self.waited_s += now_s - self._stands_since_s

    def begins(self, before_s: float) -> None:
        """The robot stands; it has been waiting for `before_s` already."""
        self._stands_since_s = time.perf_counter() - before_s

    def share(self, seconds: float) -> float:
        """Of the time since the first drive; 0 without one."""
        if self._began_s is None:
            return 0.0
        return seconds / max(self._stands_since_s - self._began_s, 1e-9)
