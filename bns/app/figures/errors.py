"""Errors: of one model after the other, and of every window."""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, FactorRange, HoverTool, Span, Whisker

from bns.app.figures.bands import band
from bns.app.figures.common import EAST_NORTH, FLOOR, SELECTING, blank, entitle, label_ticks
from bns.diagnose.data.variables import label
from bns.diagnose.predict.paired_errors import HorizonErrors
from bns.plotting.style import BLUE, GREY, OKABE_ITO, RED


class LadderFigure:
    """The error of one model after the other, with intervals, above the noise of the tracking."""

    def __init__(self) -> None:
        self.source = ColumnDataSource({"name": [], "error": [], "low": [], "high": []})
        self.figure = blank(
            "", "", "position error (mm)", height=240, x_range=FactorRange(), y_range=(0, 1), tools="hover,reset"
        )
        self.figure.scatter("name", "error", source=self.source, size=11, color=BLUE)
        self.figure.line("name", "error", source=self.source, color=BLUE)
        self.figure.add_layout(
            Whisker(base="name", lower="low", upper="high", source=self.source, line_color=BLUE, line_width=2)
        )
        self._noise = Span(location=0, dimension="width", line_dash="dotted", line_color=GREY, line_width=2)
        self.figure.add_layout(self._noise)
        self.figure.xaxis.major_label_orientation = 0.6

    def fill(self, e: HorizonErrors) -> None:
        """The models of a horizon."""
        names = [m.name for m in e.models]
        self.figure.x_range.factors = names
        values = {key: [1e3 * getattr(m, f"{key}_m") for m in e.models] for key in ("rms", "low", "high")}
        self.source.data = {"name": names, "error": values["rms"], "low": values["low"], "high": values["high"]}
        self.figure.y_range.end = 1.1 * max(
            [v for v in (*values["rms"], *values["high"]) if np.isfinite(v)], default=1.0
        )
        self._noise.location = 1e3 * e.noise_floor_m if np.isfinite(e.noise_floor_m) else 0
        entitle(self.figure, "Error, 95 % interval; dotted: tracking noise")


class WindowFigures:
    """Errors of all windows four ways; what is brushed in one is marked in all, since they share one source."""

    def __init__(self) -> None:
        numbers = ("t_s", "number", "error_mm", "x_m", "y_m", "along", "from_s", "size")
        self.source = ColumnDataSource({**{k: [0.0] for k in numbers}, "trial": [""]})
        self._noise: list[Span] = []
        self._bands = {name: ColumnDataSource({k: [0.0] for k in ("x", "rms", "low", "high")}) for name in ("t_s", "along")}
        self.time = self._scatter("Over time", "time in the trial (s)", "t_s")
        self.along = self._scatter("Along the variable that is chosen above", "", "along")
        self.trial = self._scatter("By trial", "trial", "number")
        self.floor = blank("On the floor: area grows with the error", *EAST_NORTH, tools=SELECTING, **FLOOR)
        self._dots(self.floor, "x_m", "y_m", "size")
        self.all = (self.time, self.along, self.trial, self.floor)

    def _scatter(self, title: str, x: str, column: str) -> Any:
        made = blank(title, x, "position error (mm)", tools=SELECTING)
        self._dots(made, column, "error_mm", 6)
        if column in self._bands:
            made.varea("x", "low", "high", source=self._bands[column], fill_color=OKABE_ITO[1], fill_alpha=0.35)
            made.line("x", "rms", source=self._bands[column], line_color="black", line_width=2)
        noise = Span(location=0, dimension="width", line_dash="dotted", line_color=GREY, line_width=2)
        made.add_layout(noise)
        self._noise.append(noise)
        return made

    def _dots(self, made: Any, x: str, y: str, size: Any) -> None:
        look = {"fill_color": BLUE, "line_color": None, "fill_alpha": 0.5}
        dots = made.scatter(x, y, source=self.source, size=size, **look, nonselection_fill_alpha=0.08)
        dots.selection_glyph = dots.glyph.clone(fill_color=RED, fill_alpha=0.9)
        tips = [("trial", "@trial"), ("until", "@t_s{0.00} s"), ("off by", "@error_mm{0.0} mm")]
        made.add_tools(HoverTool(renderers=[dots], tooltips=tips))

    def fill(self, table: Any, variable: str, noise_floor_m: float) -> None:
        """``table``: the windows, a row each, of `Workbench.windows`."""
        columns = {
            name: table[name].to_numpy() for name in ("t_s", "number", "error_mm", "x_m", "y_m", "trial", "from_s")
        }
        largest = max(float(columns["error_mm"].max()), 1e-9) if len(table) else 1.0
        size = 4 + 14 * columns["error_mm"] / largest
        self.source.selected.indices = []
        self.source.data = {**columns, "along": table[variable].to_numpy(), "size": size}
        for name, source in self._bands.items():
            found = band(table[variable if name == "along" else name].to_numpy(float), columns["error_mm"], columns["number"])
            source.data = {key: getattr(found, key) for key in ("x", "rms", "low", "high")}
        self.along.xaxis.axis_label = label(variable)
        named = dict(zip(columns["number"].tolist(), map(str, columns["trial"]), strict=True))
        label_ticks(self.trial, named)  # as the lists name them, whatever the log counts from
        for span in self._noise:
            span.location = 1e3 * noise_floor_m if np.isfinite(noise_floor_m) else 0
        entitle(self.floor, f"On the floor: area grows with the error{noise_in_words(noise_floor_m)}")


def noise_in_words(noise_floor_m: float) -> str:
    """For the title of a picture without an axis of errors; "" where the noise is not known."""
    return f"; noise of the tracking: {1e3 * noise_floor_m:.2f} mm" if np.isfinite(noise_floor_m) else ""
