"""A trial run again from its journal: the same rows, without a robot."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from bns.bootstrap.loop import RunResult, run
from bns.console import live_view
from bns.errors import HardwareError
from bns.hardware.link.hardware_log import events
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.sweep.single_run import keep_run
from bns.trial.background import BackgroundDriver
from bns.trial.evaluation import Evaluation
from bns.trial.folder import past_evaluations, spec_of
from bns.worlds.robot import RobotWorld

SWEEP = "trials-replayed"


class _NoRobot:
    """A driver that is never asked to drive."""

    def evaluate(self, number: int, controller: np.ndarray) -> Evaluation:
        raise HardwareError(f"the journal has no evaluation {number}; resume the trial itself: --resume")

    def evaluated(self, number: int, rounds: int, row: Mapping[str, Any]) -> None:
        pass

    def skipped(self, number: int, controller: np.ndarray, rounds: int) -> None:
        pass


@dataclass(frozen=True)
class Replayed:
    """A trial that was run again: its spec, its tables, how long that took, and a report in words."""

    spec: RunSpec
    result: RunResult
    wall_s: float
    text: str


def replayed(journal: Path, results: Path) -> Replayed:
    """Run the evaluations of a journal again and store them."""
    past = past_evaluations(journal)
    if not past:
        raise HardwareError(f"{journal} holds no evaluation that was driven; there is nothing to replay.")
    asked = spec_of(journal)
    spec = replace(asked, evaluations=len(past))
    began, started = time.perf_counter(), datetime.now(UTC)
    with live_view(spec) as show, BackgroundDriver(load_robot(spec.robot), _NoRobot(), past, most_rounds=1) as driver:
        result = run(spec, show, RobotWorld("robot-replayed"), driver)
    wall_s = time.perf_counter() - began
    keep_run(spec, result, results, SWEEP, started, wall_s)
    evals = result.tables["evals"]
    stored = len(evals["evaluated_fitness_world"])
    ended = any(events(journal, "complete"))
    cut = (
        f": {stored} of the {asked.evaluations} evaluations of an unfinished trial; the journal has no line `complete`: "
        "the trial did not come to its end"
    )
    text = (
        f"replayed {len(past)} evaluations of {journal}, run {spec.run_id}: fitness of the last in the world "
        f"{evals['evaluated_fitness_world'][-1]:.4f}, goals reached {evals['evaluated_goals_reached'][-1]}; "
        f"stored in sweep {SWEEP}{'' if ended else cut}"
    )
    return Replayed(spec, result, wall_s, text)
