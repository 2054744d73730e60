"""One of the two runs that are compared: its spec, and its path, for which it is driven again."""

from __future__ import annotations

from html import escape
from typing import Any

import panel as pn

from bns.api.run import RunResult
from bns.app.background import Background
from bns.app.figures.floor import GoalFigure
from bns.app.html import table
from bns.app.parts import WIDE, drawn, heading, html
from bns.app.results.study import OUTCOMES, PARAMETERS, Study
from bns.app.screens.working import Working
from bns.plotting.style import floor_poses
from bns.robots import load_robot
from bns.tasks import load_task


class OneRun:
    """``letter``: A or B."""

    def __init__(self, study: Study, letter: str) -> None:
        self._study, self._run_id = study, ""
        self._background: Background[RunResult] = Background()
        self._said, self._picture, self._canvas = html(), GoalFigure(), pn.Column(**WIDE)
        self._work = Working("Repeat the run to see its path", self._begin, lambda: self._background, self._show)
        self._letter = letter
        self.view = pn.Column(
            heading(f"Run {letter}"), self._said, self._work.buttons, self._work.said, self._canvas, **WIDE
        )

    def show(self, run_id: str) -> None:
        """Another run."""
        if run_id == self._run_id:
            return
        self._background.stop()
        self._background, self._run_id = Background(), run_id
        self._canvas.objects = []
        found = self._study.runs[self._study.runs["run_id"] == run_id]
        if found.empty:
            self._said.object = "<p>No run is chosen.</p>"
            return
        row = found.iloc[0]
        rows = [[name.replace("_", " "), _text(row[name])] for name in ("sweep", "robot", "task", "seed", *PARAMETERS)]
        rows += [[words, _text(row[name])] for name, words in OUTCOMES.items()]
        self._said.object = table(["", escape(run_id)], rows, "", f"bns-run-{self._letter.lower()}")
        self._work.enter()

    def _begin(self) -> None:
        study, run_id = self._study, self._run_id
        if run_id:
            self._background.start("driving", lambda tell: study.drive_again(run_id, tell))

    def _show(self, result: RunResult) -> None:
        fill_path(self._picture, result)
        self._canvas.objects = [drawn(self._picture.figure)]


def fill_path(picture: GoalFigure, result: RunResult) -> None:
    """Where the fittest controller drove at the end, and where its networks expected it."""
    spec = result.spec
    robot, task = load_robot(spec.robot), load_task(spec.robot, spec.task)
    driven, expected = (floor_poses(robot, poses) for poses in (result.result.world_poses, result.result.snn_poses))
    picture.fill(f"{task.title}: the fittest at the end", task.goals_m, driven, expected)


def _text(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
