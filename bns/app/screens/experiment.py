"""The next experiment: the arena drawn with the mouse, the proposed trials as each explanation expects them, power by minutes."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np
import panel as pn

from bns.api.diagnose import diagnose
from bns.api.propose import ProposeResult, checked_minutes, proposed
from bns.app.background import Tell
from bns.app.figures.floor import ArenaFigure, PowerFigure, Sides
from bns.app.html import table
from bns.app.names import called
from bns.app.parts import WIDE, Problem, beside, download, drawn, heading, html, offer, on_change, row
from bns.app.screens.working import Working
from bns.app.tab import Tab
from bns.app.workbench import Workbench
from bns.diagnose.report.proposal_figure import foreseen
from bns.diagnose.report.proposal_text import proposal_lines
from bns.errors import DataError

_SIDES = ("x from (m)", "x to (m)", "y from (m)", "y to (m)")


class ExperimentPart:
    """Of the Next screen. The proposal is that of `bns propose` for the model as given."""

    def __init__(self, tab: Tab) -> None:
        self._tab, self._problem = tab, Problem()
        self._bench: Workbench | None = None
        self._frame_s = 0.04
        self._picture, self._power = ArenaFigure(self._draw), PowerFigure()
        self._minutes = pn.widgets.FloatInput(
            **called("Minutes of driving"), value=5.0, start=0.1, end=600, step=1, width=130
        )
        self._sides = [pn.widgets.FloatInput(**called(name), value=0.0, step=0.1, width=95) for name in _SIDES]
        for side in self._sides:
            on_change(side, lambda: self._picture.arena(self._arena()))
        self._trial = pn.widgets.Select(**called("Proposed trial"), options=[], width=140)
        self._time = pn.widgets.Player(
            **called("Time"), start=0, end=1, value=0, interval=40, loop_policy="loop", show_loop_controls=False, width=260
        )
        on_change(self._trial, self._show_trial)
        on_change(self._time, lambda: self._picture.at(self._frame_s * self._time.value))
        self._table, self._save, self._floor = html(), html(), pn.Column(**WIDE)
        self._work = Working("Propose the next experiment", self._begin, lambda: tab.experiment, self._show)
        self._found = pn.Column(**WIDE)  # a picture that is hidden has no size to begin with, which Bokeh complains of
        controls = pn.Column(
            html(
                "<p>Commands that tell the remaining explanations apart in the least time on the robot. "
                "The arena begins as the area in which the robot was seen, without the outermost 0.5 % of the poses on each "
                "side.</p>"
            ),
            row(*self._sides, self._minutes),
            self._work.buttons,
            self._problem.view,
            self._work.said,
            self._found,
            **WIDE,
        )
        self.view = pn.Column(heading("The next experiment"), beside(self._floor, controls, least=330), **WIDE)

    def enter(self) -> None:
        """Where the robot was seen, and the proposal as it stands."""
        bench = self._tab.bench
        if bench is None:
            return
        places = bench.ready.predictor.tracks.pose[:, :2]
        self._picture.seen(places)
        self._picture.arena(self._arena())
        if bench is not self._bench:
            self._bench, self._found.objects = bench, []
            self._picture.clear()
            low, high = np.quantile(places, [0.005, 0.995], axis=0)
            self._draw((float(low[0]), float(high[0]), float(low[1]), float(high[1])))
        if not self._floor.objects:
            self._floor.objects = [drawn(self._picture.figure)]
        self._work.enter()

    def _arena(self) -> Sides:
        a, b, c, d = (float(side.value or 0.0) for side in self._sides)
        return a, b, c, d

    def _draw(self, sides: Sides) -> None:
        for widget, value in zip(self._sides, sides, strict=True):
            widget.value = round(value, 3)
        self._picture.arena(self._arena())

    def _begin(self) -> None:
        bench, model, minutes, arena = self._tab.bench, self._tab.model, float(self._minutes.value or 0), self._arena()
        if bench is None:
            self._problem.show("Open a log first, on the Data screen.")
            return
        try:
            checked_minutes(minutes)
        except DataError as fault:
            self._problem.show(str(fault))
            return
        self._problem.show("")
        kept = self._tab.diagnosis

        def work(tell: Tell) -> ProposeResult:
            found = kept.result or diagnose(bench.ready.log, model, progress=tell)
            return proposed(found, minutes=minutes, arena=arena, progress=tell)

        self._tab.experiment.start("planning", work)

    def _show(self, result: ProposeResult) -> None:
        pairs = result.proposal.model_pairs
        rows = [[f"{p.first} or {p.second}", f"{p.power:.0%}", _minutes(p)] for p in pairs]
        caption = f"{len(result.proposal.plan)} trials"
        columns = ["which is it?", "chance of a decision", "minutes for a probability of 90 %"]
        said = "".join(f"<p>{escape(line)}</p>" for line in proposal_lines(result.proposal))
        self._table.object = table(columns, rows, caption, "bns-pairs") + said
        curves = [(p.power_by_minutes, f"{p.first} / {p.second}") for p in pairs if p.power_by_minutes]
        if curves:
            self._power.fill([c for c, _ in curves], [name for _, name in curves])
        numbers = range(len(result.proposal.plan))
        offer(self._trial, {f"trial {n}": n for n in numbers})
        player = row(self._trial, self._time, align_items="end")
        power = [drawn(self._power.figure)] if curves else []  # Bokeh complains of a picture without a point
        self._found.objects = [*([player] if numbers else []), self._table, *power, self._save]
        self._save.object = ""
        if numbers:
            text = result.commands.to_csv(index=False).encode()
            self._save.object = download("Save the commands (bns trial --commands)", "next.csv", text, "text/csv")
            self._trial.value = 0
            self._show_trial()

    def _show_trial(self) -> None:
        result, number = self._tab.experiment.result, self._trial.value
        if result is None or number is None:
            return
        p = result.proposal
        tracks = foreseen(p, np.array([number]))
        t_s = tracks[0].t_s
        names = [model.title for model in p.competing_models]
        title = f"Trial {number}, {p.plan.lasting_s[number]:.0f} s, as each explanation predicts it"
        self._picture.trial(title, t_s, [each.pose for each in tracks], names)
        self._frame_s = float(t_s[-1]) / max(len(t_s) - 1, 1)
        self._time.end, self._time.value = len(t_s) - 1, 0
        self._picture.at(0.0)


def _minutes(pair: Any) -> str:
    if pair.indistinguishable:
        return "no commands tell them apart; measure " + ("; ".join(pair.independent_measurements) or "something else")
    return f"{pair.minutes:.1f}"
