"""Bootstrapped Neuro-Simulation on a robot: training and evolution go on while it drives, as in the source.

How many rounds of training and evolution fit into a drive depends on the machine; the number is noted with the drive. So a trial
repeats what was driven already, round by round, and goes on from there, to the same numbers.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from bns.bootstrap.evolver import Evolver
from bns.bootstrap.loop import RunResult
from bns.bootstrap.recorder import Recorder
from bns.bootstrap.trainer import Trainer
from bns.engine.philox import Key
from bns.errors import HardwareError
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task
from bns.trial.background import Rounds
from bns.worlds.robot import RobotWorld, in_task_frame

Progress = Callable[[Mapping[str, Any]], None]


@dataclass(frozen=True)
class Evaluation:
    """What one evaluation left: the controller picked (n, c), what was carried out (k, c), tracked poses (k + 1, columns), how
    many rounds of training and evolution went on meanwhile (None: not known, the trial was cut off), and the numbers, from 1, of
    the commands that a person called unstable."""

    picked: np.ndarray
    commands: np.ndarray
    poses: np.ndarray
    rounds: int | None = None
    unstable: tuple[int, ...] = ()


class Driver(Protocol):
    """Who has the robot."""

    def evaluate(self, number: int, controller: np.ndarray) -> Evaluation:
        """Drive a controller. Called in the thread that signals arrive in."""

    def evaluated(self, number: int, rounds: int, row: Mapping[str, Any]) -> None:
        """An evaluation is complete."""


@dataclass(frozen=True)
class TrialResult:
    """The run, and the share of the time (by the computer's clock) that the robot waited for computations."""

    run: RunResult
    waited_share: float
    rounds: int


class Trial:
    """One trial; `past` are evaluations driven before, `most_rounds` bounds what goes on during one drive.

    With `until_success` it ends when so many controllers in a row have succeeded on the robot.
    """

    def __init__(
        self, spec: RunSpec, digest: str, past: list[Evaluation], most_rounds: int, until_success: int | None = None
    ) -> None:
        self.spec, self._past, self._until_success = spec, past, until_success
        self.robot, self.task = load_robot(spec.robot), load_task(spec.robot, spec.task)
        key = Key.of_run(spec.seed, spec.root_seed, spec.robot, spec.task)
        self._world = RobotWorld(digest)
        self._trainer = Trainer.start(self.robot, key, spec)
        self._weights = self._trainer.evolution_weights()
        self._evolver = Evolver.start(self.robot, self.task, key, spec, self._weights)
        self._recorder = Recorder(self.robot, self.task, self._world, key, spec)
        self._most_rounds, self._rounds = most_rounds, 0

    def run(self, driver: Driver, progress: Progress) -> TrialResult:
        """All evaluations, those of the past first."""
        began, idle_s, in_a_row = time.perf_counter(), 0.0, 0
        with Rounds(self._round, self._most_rounds) as rounds:
            for number in range(1, self.spec.evaluations + 1):
                asked = time.perf_counter()
                weights = self._weights
                picked = self._evolver.plan(self._evolver.pick(number), weights)
                idle_s += time.perf_counter() - asked
                done, count = self._evaluation(number, picked, driver, rounds)
                driven = time.perf_counter()
                row = self._learn(number, done, weights)
                driver.evaluated(number, count, row)
                progress(row)
                idle_s += time.perf_counter() - driven
                in_a_row = in_a_row + 1 if row["evaluated_success"] else 0
                if in_a_row == self._until_success:
                    break
            share = (rounds.waited_s + idle_s) / (time.perf_counter() - began)
        return TrialResult(self._result(), share, self._rounds)

    def _evaluation(self, number: int, picked: np.ndarray, driver: Driver, rounds: Rounds) -> tuple[Evaluation, int]:
        """Drive, or take what was driven in the past; either way the rounds that went with it."""
        if number <= len(self._past):
            done = self._past[number - 1]
            if done.picked.shape != picked.shape or not np.allclose(done.picked, picked, rtol=1e-5):
                raise HardwareError(
                    f"evaluation {number} of the journal drove another controller than this bns picks: it was made with another "
                    "version or other parameters. Take the bns it names, or begin a new trial with another --seed."
                )
            count = done.rounds or 1
            rounds.repeat(count)
            return done, count
        found: list[Evaluation] = []
        count = rounds.while_driving(lambda: found.append(driver.evaluate(number, picked)))
        return found[0], count

    def _round(self) -> None:
        self._trainer.train()
        self._weights = self._trainer.evolution_weights()
        self._evolver.evolve(self._weights)
        self._rounds += 1

    def _learn(self, number: int, done: Evaluation, weights: np.ndarray) -> Mapping[str, Any]:
        poses = self.robot.marked_unstable(in_task_frame(self.robot, done.poses), done.unstable)
        self._world.answered(poses)
        self._recorder.drive_evaluated(number, done.commands, weights)
        self._trainer.add(done.commands, poses, number)
        return self._recorder.record(number, self._trainer, self._evolver, self._weights, 0.0, 0.0)

    def _result(self) -> RunResult:
        return RunResult(
            self._recorder.tables(),
            self._world.digest,
            self.robot.networks,
            self._weights,
            self._evolver.fittest(),
            self._recorder.last_poses,
            self._recorder.last_simulated,
            self._trainer.data.training.in_use(),
        )
