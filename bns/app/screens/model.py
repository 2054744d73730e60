"""Which model is compared with the log: one of the catalogue, a YAML file, or a drive whose wheelbase the data suggest."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import Any

import panel as pn

from bns.api.model import Model
from bns.app.jobs import Jobs
from bns.app.names import called
from bns.app.parts import WIDE, Problem, beside, button, heading, html, on_change
from bns.app.tab import Tab
from bns.diagnose.predict.saved_networks import OF_ROBOT
from bns.physics.jointed.model_files import SNAKE
from bns.physics.model import BASES, model_names

ROBOTS = [*model_names(), SNAKE, SNAKE + OF_ROBOT]
"""Drives, the snake in MuJoCo, and the snake's static simulator."""


class ModelScreen:
    """Takes another model; all switches go off then."""

    def __init__(self, tab: Tab, jobs: Jobs) -> None:
        self._tab, self._jobs = tab, jobs
        self._problem, self._bench_problem, self._said = Problem(), Problem(), html()
        self._name = pn.widgets.Select(**called("A robot of the catalogue"), options=ROBOTS, **WIDE)
        self._path = pn.widgets.TextInput(**called("Or a model file of this machine"), placeholder="mine.yaml", **WIDE)
        self._file = pn.widgets.FileInput(
            **called("Or choose a model file, or drop it on this screen"), accept=".yaml,.yml,.xml,.safetensors"
        )
        self._wheelbase = pn.widgets.FloatInput(
            **called("Or a differential drive: wheelbase (m)"), value=0.1, start=0.001, end=10, step=0.001, **WIDE
        )
        self._suggestion = html()
        on_change(self._file, self._take_uploaded)
        left = pn.Column(
            heading("Take a model"),
            self._name,
            button("Take this robot", lambda: self._take(self._name.value), "primary"),
            self._path,
            button("Take this file", self._take_path),
            self._file,
            self._wheelbase,
            self._suggestion,
            button("Take this drive", self._take_drive),
            self._problem.view,
            **WIDE,
        )
        self.view = beside(left, pn.Column(heading("The model"), self._said, self._bench_problem.view, **WIDE))

    def enter(self) -> None:
        """The model as the tab has it."""
        self._said.object = f"<pre id='bns-model' class='bns-copy'>{escape(self._in_words())}</pre>"
        self._bench_problem.show(self._tab.why_no_bench)
        used = self._tab.used
        suggested = None if used is None else used.suggested_wheelbase_m
        if suggested is not None:
            self._wheelbase.value = round(suggested, 5)
            self._suggestion.object = f"<p>The turns in the log suggest {suggested:.4g} m.</p>"

    def _in_words(self) -> str:
        tab = self._tab
        return f"networks {tab.networks}: they are compared, nothing is fitted" if tab.networks else tab.model.summary()

    def _take_path(self) -> None:
        text = (self._path.value_input or self._path.value).strip()
        if text:
            self._take(text)

    def _take_drive(self) -> None:
        width = float(self._wheelbase.value)
        self._work(
            lambda: self._tab.take(Model(wheelbase_m=width, name=BASES[0]), (BASES[0], "--wheelbase", f"{width:g}"))
        )

    def _take_uploaded(self) -> None:
        if not self._file.value:
            return
        path = self._tab.folder / Path(self._file.filename).name
        path.write_bytes(self._file.value)
        self._work(lambda: self._tab.take(path, (path.name,)))

    def _take(self, name: str) -> None:
        self._work(lambda: self._tab.take(name, (name,)))

    def _work(self, work: Callable[[], None]) -> None:
        self._jobs.run("taking the model", work, self._done, self._problem.show)

    def _done(self, _none: Any) -> None:
        self._problem.show("")
        self.enter()
        self._jobs.changed(self)
