"""The final controller of a trial driven several times, to show how repeatable it is (the dissertation's figures 5.16 to 5.21).

The first of the drives is the evaluation's own. It was picked for its success where there was one, so that the others
are the fairer sample of what the controller is worth.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from bns.measurements import write_measurements
from bns.robots.base import Robot
from bns.tasks import Task
from bns.trial.driver import TrialDriver
from bns.trial.evaluation import Evaluation
from bns.trial.folder import past_evaluations, past_repeats
from bns.worlds.robot import in_task_frame


def final_evaluation(evals: Mapping[str, np.ndarray]) -> int:
    """The evaluation whose controller a trial ends with: the last that reached all goals, or the last."""
    successes = np.flatnonzero(evals["evaluated_success"].astype(bool))
    return int(evals["evaluation"][successes[-1] if len(successes) else -1])


def drive_repeats(driver: TrialDriver, journal: Path, evaluation: int, count: int) -> list[Evaluation]:
    """All `count` drives of an evaluation's controller, its own first; those that the journal has are not driven again.

    TrialPausedError, StopNotConfirmedError; what was driven until then is in the journal.
    """
    own = past_evaluations(journal)[evaluation - 1]
    done = [own, *past_repeats(journal, evaluation)][:count]
    for again in range(len(done) + 1, count + 1):
        drive = driver.repeat(evaluation, again, own.picked)
        if drive.skipped:
            driver.skipped(evaluation, own.picked, 0, again)
        done.append(drive)
    return [drive for drive in done if not drive.skipped]


def repeats_table(drives: Sequence[Evaluation], evaluation: int, robot: Robot, task: Task) -> pd.DataFrame:
    """A row a pose: `evaluation`, `repeat` from 1, `success`, `step` (0: the start), the command that led there, and the
    pose in the task's frame, in the columns of the table `paths`."""
    tables = [_rows(drive, robot, task).assign(evaluation=evaluation, repeat=n) for n, drive in enumerate(drives, 1)]
    return pd.concat(tables, ignore_index=True)


def _rows(drive: Evaluation, robot: Robot, task: Task) -> pd.DataFrame:
    poses = in_task_frame(robot, drive.poses)
    if robot.marks_unstable:
        poses = robot.marked_unstable(poses, drive.unstable)
    rows = pd.DataFrame(robot.pose_columns(np.vstack([robot.start_pose(), poses])))
    rows.insert(0, "step", np.arange(len(rows)))
    for name, values in zip(robot.command_columns, drive.commands[: len(poses)].T, strict=True):
        rows[name] = np.concatenate([[np.nan], values])
    return rows.assign(success=robot.succeeded(poses, task))


def write_repeats(table: pd.DataFrame, path: Path) -> None:
    """Write the table of all drives; a reader never meets half a file."""
    write_measurements(table, path, ("evaluation", "repeat", "success", "step", "x_m", "y_m", "heading_rad"))
