"""Where the model fails: the error of every window four ways, brushed together, and the worst moments."""

from __future__ import annotations

from typing import Any

import pandas as pd
import panel as pn

from bns.api.compare import CompareResult
from bns.app.figures.common import entitle
from bns.app.figures.errors import WindowFigures, noise_in_words
from bns.app.figures.paths import PathFigure
from bns.app.html import mm, note, table
from bns.app.jobs import Jobs
from bns.app.names import called
from bns.app.parts import WIDE, Problem, beside, drawn, heading, html, offer, on_change, row
from bns.app.sliders import Slider
from bns.app.tab import Tab
from bns.app.workbench import Shown, Workbench
from bns.diagnose.data.variables import label, velocity
from bns.diagnose.report.tables import ahead

GIVEN, NOW = "as given", "as it is now"


class WhereScreen:
    """Numbers are those of `bns compare` of the chosen model."""

    def __init__(self, tab: Tab, jobs: Jobs) -> None:
        self._tab, self._jobs = tab, jobs
        self._problem, self._pictures, self._path = Problem(), WindowFigures(), PathFigure("path")
        self._which = pn.widgets.RadioButtonGroup(**called("Model"), options=[GIVEN, NOW], value=GIVEN)
        self._horizon = pn.widgets.Select(**called("Error how far ahead"), options={ahead("1s"): "1s"}, width=160)
        self._variable = pn.widgets.Select(**called("Along"), options={label("time_in_trial_s"): "time_in_trial_s"}, width=350)
        self._worst = pn.widgets.Select(**called("Worst moments"), options=[], size=6, width=350)
        self._trial = pn.widgets.Select(**called("Trial"), options=[], width=240)
        self._time = Slider(**called("Time in the trial (s)"), start=0, end=1, step=0.02, **WIDE)
        self._errors, self._explained, self._brushed = html(), html(), html()
        self._shown: Shown | None = None
        self._windows, self._rows = pd.DataFrame(), list[int]()
        self._bench: Workbench | None = None
        self._to_choose = True  # the variable that explains most is shown, until the user wants another
        for widget, act in (
            (self._which, self._begin),
            (self._horizon, self._fill),
            (self._variable, self._fill),
            (self._trial, self._show_path),
            (self._time, self._show_time),
            (self._worst, self._go_to),
        ):
            on_change(widget, act)
        self._pictures.source.selected.on_change("indices", lambda _attr, _old, new: self._say_brushed(new))
        self.view = self._laid_out()

    def enter(self) -> None:
        """The tab's log and model, compared."""
        bench = self._tab.bench
        if bench is None:
            self._problem.show(self._tab.why_no_bench or "Open a log first, on the Data screen.")
            return
        self._problem.show("")
        if bench is not self._bench:
            self._bench = bench
            self._shown = None
            names = list(bench.ready.predictor.tracks.names)
            offer(self._trial, dict(zip(names, range(len(names)), strict=True)))
            self._horizon.options = {ahead(h): h for h in bench.horizons}
            self._horizon.value = bench.ready.predictor.near
            self._to_choose = True
            offer(self._variable, {label(v): v for v in bench.ready.predictor.variables()})
        self._begin()

    def _begin(self) -> None:
        bench = self._bench
        if bench is None:
            return
        state, given = self._tab.now, self._which.value == GIVEN

        def judged() -> Shown:
            return bench.as_given if given else bench.shown(state)

        def compared() -> CompareResult:
            return self._tab.compared(judged().model)

        self._jobs.run("judging every window", judged, self._judged, self._problem.show)
        self._jobs.run("comparing", compared, self._compared, self._problem.show)  # of a long log, long after the pictures

    def _judged(self, shown: Shown) -> None:
        self._shown = shown
        self._fill()
        self._show_path()

    def _compared(self, result: CompareResult) -> None:
        comparison = result.comparison
        rows = [
            [ahead(h), mm(e["position_m"]), mm(e["position_se_m"]), mm(comparison.noise_floor_m(h)), int(e["windows"])]
            for h, e in comparison.errors.items()
            if e["windows"]
        ]
        columns = ["after", "error, mm", "± se", "noise, mm", "windows"]
        caption = f"Position error of the model {self._which.value}, on all trials"
        self._errors.object = table(columns, rows, caption, "bns-compared") + note(self._bench.thinned if self._bench else "")
        explained = [
            [label(p.variable), velocity(p.channel), f"{p.share:.2%}", f"{p.paired_comparison.p_value:.2g}"]
            for p in comparison.residual_dependence[:8]
        ]
        columns = ["variable", "added to", "fraction of loss", "p"]
        self._explained.object = table(columns, explained, "Fraction of the loss that a curve along each variable would remove")
        best = [p.variable for p in comparison.residual_dependence if p.variable in self._variable.values]
        if best and self._to_choose:
            self._to_choose, self._variable.value = False, best[0]
        self._worst.options = {
            f"{1e3 * w.position_m:.1f} mm from {w.t_s:.2f} s of trial {w.trial}": (w.trial, w.t_s)
            for w in comparison.worst
        }
        if comparison.worst:
            self._worst.value = next(iter(self._worst.options.values()))

    def _fill(self) -> None:
        if self._shown is None or self._bench is None:
            return
        predictor, model = self._bench.ready.predictor, self._shown.model
        self._windows = self._bench.windows(predictor.steps(model), self._horizon.value)
        floor = self._shown.errors.horizons[self._horizon.value].noise_floor_m
        self._pictures.fill(self._windows, self._variable.value, floor)
        if self._trial.value is not None:
            entitle(self._path.figure, self._path_title())
        self._rows = []
        self._say_brushed([])

    def _say_brushed(self, rows: list[int]) -> None:
        self._rows = rows
        chosen = self._windows.iloc[rows] if rows else self._windows
        if not len(chosen):
            return
        rms = float((chosen["error_mm"] ** 2).mean() ** 0.5)
        what = (
            f"{len(rows)} windows brushed, of {chosen['trial'].nunique()} trials"
            if rows
            else f"All {len(chosen)} windows"
        )
        self._brushed.object = f"<p id='bns-brushed'>{what}: {rms:.2f} mm (root mean square)</p>"
        if rows:
            worst = chosen.iloc[int(chosen["error_mm"].to_numpy().argmax())]
            self._trial.value = int(worst["number"])
            self._time.value = min(float(worst["t_s"]), self._time.end)
        self._mark()

    def _mark(self) -> None:
        """On the paths what was brushed of the trial that is shown."""
        mine = self._windows.iloc[self._rows]
        mine = mine[mine["number"] == self._trial.value] if self._rows else mine
        self._path.mark(list(zip(mine["from_s"], mine["t_s"], strict=True)) if self._rows else [])

    def _go_to(self) -> None:
        if self._bench is None or self._worst.value is None:
            return
        trial, t_s = self._worst.value
        self._trial.value = self._trial.options[trial]
        self._show_path()
        self._time.value = min(t_s, self._time.end)

    def _show_path(self) -> None:
        if self._bench is None or self._shown is None or self._trial.value is None:
            return
        number = self._trial.value
        t_s, measured = self._bench.measured(number)
        path = self._bench.path(self._bench.ready.predictor.steps(self._shown.model), number)
        self._path.fill(self._path_title(), t_s, measured, path)
        if len(t_s) and t_s[-1] > 0:
            self._time.end = float(t_s[-1])
        self._mark()
        self._show_time()

    def _path_title(self) -> str:
        """Trial and noise, at the horizon of the other pictures."""
        assert self._bench is not None
        assert self._shown is not None
        floor = self._shown.errors.horizons[self._horizon.value].noise_floor_m
        return f"Trial {self._bench.ready.predictor.tracks.names[self._trial.value]}{noise_in_words(floor)}"

    def _show_time(self) -> None:
        self._path.at(min(self._time.value, self._time.end))

    def _laid_out(self) -> Any:
        p = self._pictures
        path = pn.Column(row(self._trial, self._worst), drawn(self._path.figure), self._time, **WIDE)
        return pn.Column(
            self._problem.view,
            row(self._which, self._horizon, self._variable, align_items="end"),
            beside(self._errors, self._explained),
            heading("Every window: brush in one picture, see it in all"),
            html(
                "<p>Line and band: root mean square in bins along the axis, and its 95 % interval over trials. Dotted: noise of "
                "the tracking. What is brushed is marked on the paths below, too.</p>"
            ),
            self._brushed,
            beside(drawn(p.time), drawn(p.along), drawn(p.trial), drawn(p.floor), least=420),
            heading("Measured and predicted"),
            path,
            **WIDE,
        )
