"""A trial run again from its journal: the same rows, without a robot."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from bns.bootstrap.loop import run
from bns.console import live_view
from bns.errors import HardwareError
from bns.hardware.link.hardware_log import events
from bns.robots import load_robot
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


def replayed(journal: Path, results: Path) -> str:
    """Run the evaluations of a journal again and store them; the report in words."""
    past = past_evaluations(journal)
    if not past:
        raise HardwareError(f"{journal} holds no evaluation that was driven; there is nothing to replay.")
    spec = replace(spec_of(journal), evaluations=len(past))
    began, started = time.perf_counter(), datetime.now(UTC)
    with live_view(spec) as show, BackgroundDriver(load_robot(spec.robot), _NoRobot(), past, most_rounds=1) as driver:
        result = run(spec, show, RobotWorld("robot-replayed"), driver)
    keep_run(spec, result, results, SWEEP, started, time.perf_counter() - began)
    evals = result.tables["evals"]
    cut = "" if any(events(journal, "complete")) else "; the journal has no line `complete`: the trial did not come to its end"
    return (
        f"replayed {len(past)} evaluations of {journal}, run {spec.run_id}: fitness of the last in the world "
        f"{evals['evaluated_fitness_world'][-1]:.4f}, goals reached {evals['evaluated_goals_reached'][-1]}; "
        f"stored in sweep {SWEEP}{cut}"
    )
