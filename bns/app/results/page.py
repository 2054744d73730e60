"""The page of a store: filters, parallel coordinates, a dot a run, two runs side by side."""

from __future__ import annotations

from functools import partial
from typing import Any

import panel as pn

from bns.app.design import template
from bns.app.figures.runs import COLOURS, CurveFigure, ParallelFigure, RunsFigure
from bns.app.names import called
from bns.app.parts import WIDE, Problem, beside, button, drawn, heading, html, on_change, row, together
from bns.app.results.hovered import HoveredRun
from bns.app.results.one_run import OneRun
from bns.app.results.study import CURVES, DIVERSITY, OUTCOMES, PARAMETERS, Study
from bns.app.web.connection import watch_connection
from bns.errors import StoreError

TITLE = "bns explore: results"
EVERY_MS, EVERY = 10_000, "Look for new runs every 10 s"
_MOST_NAMES = 2_000
"""Of runs in a menu; filters make the list shorter."""
_MOST_SHOWN = 6
"""Of a filter's values without scrolling."""


def results_page(study: Study) -> Any:
    """A page of its own for every tab of the browser."""
    made = template(TITLE)
    watch_connection(pn.state.curdoc)
    made.main.append(ResultsScreen(study).view)
    return made


class ResultsScreen:
    """What the filters leave, drawn three ways."""

    def __init__(self, study: Study) -> None:
        self._study, self._problem, self._count = study, Problem(), html()
        self._filters = {name: _menu(name) for name in ("sweep", "robot", "task", *PARAMETERS)}
        self._x = pn.widgets.Select(**called("Across"), options=_options(OUTCOMES), value="diversity", width=220)
        self._y = pn.widgets.Select(**called("Up"), options=_options(OUTCOMES), value="fitness_error", width=220)
        self._curve = pn.widgets.Select(**called("Curve"), options=_options(CURVES), width=220)
        self._names = [pn.widgets.Select(**called(f"Run {letter}"), options=[], **WIDE) for letter in "AB"]
        self._live = pn.widgets.CheckBoxGroup(options=[EVERY])  # a single Checkbox of Panel has no name for a screen reader
        self._clock: Any = None
        self._next = 0
        self._dots, self._parallel, self._curves = RunsFigure(self._pick, self._hover), ParallelFigure(), CurveFigure()
        self._curve_pane = pn.Column(**WIDE)
        self._runs, self._hovered = [OneRun(study, letter) for letter in "AB"], HoveredRun(study)
        for menu in self._filters.values():
            on_change(menu, self._draw)
        for axis in (self._x, self._y):
            on_change(axis, self._draw)
        for which, name in enumerate(self._names):
            on_change(name, partial(self._show_run, which, name))
        on_change(self._curve, self._draw_curves)
        on_change(self._live, lambda: self._watch(bool(self._live.value)))
        self.view = self._laid_out()
        self._fill_menus()
        self._draw()
        self._draw_curves()

    def _laid_out(self) -> Any:
        filters = pn.Column(
            heading("Which runs"),
            self._count,
            row(button("Look for new runs", self._refresh), self._live, align_items="center"),
            self._problem.view,
            *self._filters.values(),
            **WIDE,
        )
        dots, said = drawn(self._dots.figure), html(f"<p>{COLOURS} {DIVERSITY}</p>")
        axes = row(self._x, self._y)
        pictures = pn.Column(drawn(self._parallel.figure), axes, dots, said, self._hovered.view, **WIDE)
        words = html(
            "<p>Click a dot, or choose here: the first click is run A, the next run B. Point at a dot to see its path and "
            "its curve.</p>"
        )
        pair = beside(self._runs[0].view, self._runs[1].view)
        compared = pn.Column(
            heading("Two runs side by side"),
            words,
            beside(*self._names, self._curve),
            self._curve_pane,
            pair,
            **WIDE,
        )
        return pn.Column(beside(filters, pictures, least=300, first=pictures), compared, **WIDE)

    def _fill_menus(self) -> None:
        for name, menu in self._filters.items():
            values = sorted(self._study.runs[name].dropna().unique().tolist(), key=_numbers_first)
            menu.options = {str(value): value for value in values}
            menu.visible, menu.size = len(values) > 1, min(max(len(values), 2), _MOST_SHOWN)

    def _draw(self) -> None:
        rows = self._study.chosen({name: menu.value for name, menu in self._filters.items()})
        varied = self._study.varied(rows)
        words = {name: name.replace("_", " ") for name in varied}
        self._parallel.fill(rows, {**words, **{k: OUTCOMES[k] for k in ("diversity", "fitness_error", "success")}})
        self._dots.fill(
            rows, (self._x.value, OUTCOMES[self._x.value]), (self._y.value, OUTCOMES[self._y.value]), varied
        )
        names = [_named(each, varied) for each in rows.head(_MOST_NAMES).to_dict("records")]
        options = {"": "", **dict(zip(names, rows["run_id"].head(_MOST_NAMES), strict=True))}
        for menu in self._names:
            kept = menu.value
            menu.options = options if kept in options.values() or not kept else {**options, kept: kept}
        self._count.object = f"<p id='bns-runs'>{len(rows)} of {len(self._study.runs)} finished runs.</p>"

    def _pick(self, run_id: str) -> None:
        menu = self._names[self._next]
        if run_id not in menu.options.values():
            menu.options = {**menu.options, run_id: run_id}
        menu.value = run_id
        self._next = 1 - self._next

    def _hover(self, run_id: str, words: str) -> None:
        if run_id:
            with together():
                self._hovered.show(run_id, words)
                self._draw_curves()

    def _show_run(self, which: int, menu: Any) -> None:
        self._runs[which].show(menu.value or "")
        self._draw_curves()

    def _draw_curves(self) -> None:
        column = self._curve.value
        self._curves.name(CURVES[column])
        for which, run_id in enumerate((*(menu.value for menu in self._names), self._hovered.run_id)):
            if run_id:
                rows = self._study.curve(run_id)
                self._curves.fill(which, rows["evaluation"], rows[column])
            else:
                self._curves.hide(which)
        if self._curves.empty == bool(self._curve_pane.objects):  # Bokeh complains of a picture without a curve
            self._curve_pane.objects = [] if self._curves.empty else [drawn(self._curves.figure)]

    def _watch(self, on: bool) -> None:
        if on and self._clock is None:
            self._clock = pn.state.add_periodic_callback(self._refresh, period=EVERY_MS)
        elif not on and self._clock is not None:
            self._clock.stop()
            self._clock = None

    def _refresh(self) -> None:
        try:
            changed = self._study.refresh()
        except StoreError as fault:
            self._problem.show(str(fault))
            return
        self._problem.show("")
        if changed:
            self._fill_menus()
            self._draw()


def _menu(name: str) -> Any:
    return pn.widgets.MultiSelect(**called(f"Only {name.replace('_', ' ')} (none: all)"), options=[], size=4, **WIDE)


def _options(words: dict[str, str]) -> dict[str, str]:
    return {text: name for name, text in words.items()}


def _numbers_first(value: object) -> tuple[bool, float, str]:
    """Numbers by their size, then all else by its text."""
    return (False, float(value), "") if isinstance(value, int | float) else (True, 0.0, str(value))


def _named(run: dict[Any, Any], varied: list[str]) -> str:
    values = ", ".join(f"{name.replace('_', ' ')} {run[name]}" for name in varied)
    return f"{run['sweep']}: {run['task']}, seed {run['seed']}" + (f", {values}" if values else "")
