"""The run whose dot the mouse points at: its name, and its path, for which it is driven again at once."""

from __future__ import annotations

from html import escape

import panel as pn

from bns.api.run import RunResult
from bns.app.background import Background
from bns.app.figures.floor import GoalFigure
from bns.app.parts import WIDE, drawn, heading, html
from bns.app.results.one_run import fill_path
from bns.app.results.study import Study
from bns.app.screens.working import Working


class HoveredRun:
    """Another dot ends what is under way for the one before."""

    def __init__(self, study: Study) -> None:
        self._study, self.run_id = study, ""
        self._background: Background[RunResult] = Background()
        self._said, self._picture, self._canvas = html(), GoalFigure(), pn.Column(**WIDE)
        self._work = Working("", lambda: None, lambda: self._background, self._show)
        parts = (heading("The run under the pointer"), self._said, self._work.said, self._canvas)
        self.view = pn.Column(*parts, visible=False, **WIDE)

    def show(self, run_id: str, words: str) -> None:
        """``words``: what is known of it."""
        if run_id == self.run_id:
            return
        self._background.stop()
        self._background, self.run_id, self.view.visible = Background(), run_id, True
        self._canvas.objects = []
        self._said.object = f"<p id='bns-hovered'>{escape(words)} ({escape(run_id)})</p>"
        self._background.start("driving", lambda tell: self._study.drive_again(run_id, tell))
        self._work.enter()

    def _show(self, result: RunResult) -> None:
        fill_path(self._picture, result)
        self._canvas.objects = [drawn(self._picture.figure)]
