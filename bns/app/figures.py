"""Pictures of the page, in Bokeh: made once, filled anew. Units on every axis, colours that everybody can tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, FactorRange, HoverTool, Span, Whisker
from bokeh.plotting import figure

from bns.diagnose.data.tracks import Array
from bns.diagnose.predict.paired_errors import HorizonErrors
from bns.plotting.style import BLUE, GREY, OKABE_ITO, RED

_TOOLS = "box_select,lasso_select,tap,pan,wheel_zoom,reset"
_FLOOR: dict[str, Any] = {"match_aspect": True, "aspect_scale": 1}
_MOST_POINTS = 4000
"""More of a path no screen shows."""


def _figure(title: str, x: str, y: str, tools: str = "pan,wheel_zoom,reset", height: int = 300, **more: Any) -> Any:
    drag = {"active_drag": "box_select"} if "box_select" in tools else {}
    made = figure(
        title=title,
        x_axis_label=x,
        y_axis_label=y,
        tools=tools,
        height=height,
        sizing_mode="stretch_width",
        styles={"max-width": "calc(100vw - 28px)"},  # where what stands beside it is wider than the window
        toolbar_location="above",
        **drag,
        **more,
    )
    made.toolbar.logo = None
    made.title.text_font_size = "12px"
    return made


def drawable(points: Array) -> Array:
    """Every so-manieth point, the last one too."""
    every = max(1, -(-len(points) // _MOST_POINTS))
    return points if every == 1 else np.concatenate([points[::every], points[-1:]])


class PathFigure:
    """Measured (solid) and predicted (dashed) path of one trial, and where both are at a time."""

    def __init__(self, title: str, beside: PathFigure | None = None) -> None:
        ranges: dict[str, Any] = (
            {} if beside is None else {"x_range": beside.figure.x_range, "y_range": beside.figure.y_range}
        )
        self.figure: Any = _figure(title, "x, east (m)", "y, north (m)", **ranges, **_FLOOR)
        self._lines = [ColumnDataSource({"x": [0.0], "y": [0.0]}) for _ in range(2)]
        self._dots = ColumnDataSource({"x": [], "y": [], "color": []})
        self._times, self._poses = np.zeros(0), (np.zeros((0, 3)), np.zeros((0, 3)))
        for source, color, dash, name in zip(
            self._lines, (BLUE, RED), ("solid", "dashed"), ("measured", "predicted"), strict=True
        ):
            self.figure.line("x", "y", source=source, color=color, line_dash=dash, line_width=2, legend_label=name)
        self.figure.scatter("x", "y", source=self._dots, color="color", size=11, line_color="black")
        self.figure.legend.location, self.figure.legend.background_fill_alpha = "top_left", 0.6

    def fill(self, title: str, t_s: Array, measured: Array, predicted: Array) -> None:
        """Poses (frames, 3) of both at the times ``t_s`` (frames,)."""
        self.figure.title.text = title
        for source, poses in zip(self._lines, (measured, predicted), strict=True):
            shown = drawable(poses)
            source.data = {"x": shown[:, 0], "y": shown[:, 1]}
        self._times, self._poses = t_s, (measured, predicted)

    def at(self, t_s: float) -> None:
        """Dots where both are at a time (s)."""
        if not len(self._times):
            return
        frame = int(np.searchsorted(self._times, t_s).clip(max=len(self._times) - 1))
        places = [poses[frame] for poses in self._poses]
        self._dots.data = {"x": [p[0] for p in places], "y": [p[1] for p in places], "color": [BLUE, RED]}


class LadderFigure:
    """The error of one model after the other, with intervals, above the noise of the tracking."""

    def __init__(self) -> None:
        self.source = ColumnDataSource({"name": [], "error": [], "low": [], "high": []})
        self.figure = _figure(
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
        self.figure.title.text = "Error and its 95 % interval; dotted: noise of the tracking"


class LogFigure:
    """All measured paths, what was found odd on them, and trials that can be selected."""

    def __init__(self) -> None:
        self.paths = ColumnDataSource({"x": [[0.0]], "y": [[0.0]], "trial": [""], "color": [BLUE]})
        self.findings = ColumnDataSource({"x": [], "y": [], "text": []})
        self.figure = _figure(
            "Measured paths; crosses: findings. Tap or brush paths to choose trials",
            *("x, east (m)", "y, north (m)"),
            tools=_TOOLS,
            height=420,
            **_FLOOR,
        )
        lines = self.figure.multi_line(
            "x", "y", source=self.paths, color="color", line_width=1.5, nonselection_alpha=0.15
        )
        self.figure.add_tools(HoverTool(renderers=[lines], tooltips=[("trial", "@trial")]))
        marks = self.figure.scatter(
            "x", "y", source=self.findings, marker="x", size=12, line_width=3, color="black", nonselection_alpha=1.0
        )
        self.figure.add_tools(HoverTool(renderers=[marks], tooltips=[("", "@text")]))

    def fill(self, paths: Sequence[Array], names: Sequence[str], findings: dict[str, list[Any]]) -> None:
        """Poses (frames, 3) of each trial; findings as x, y, text."""
        most = max(50, 60_000 // max(len(paths), 1))
        thin = [p[:: max(1, -(-len(p) // most))] for p in paths]
        self.paths.selected.indices = []
        self.paths.data = {
            "x": [p[:, 0] for p in thin],
            "y": [p[:, 1] for p in thin],
            "trial": list(names),
            "color": [OKABE_ITO[i % len(OKABE_ITO)] for i in range(len(thin))],
        }
        self.findings.data = findings


class WindowFigures:
    """Errors of all windows four ways; what is brushed in one is marked in all, since they share one source."""

    def __init__(self) -> None:
        numbers = ("t_s", "number", "error_mm", "x_m", "y_m", "along", "from_s", "size")
        self.source = ColumnDataSource({**{k: [0.0] for k in numbers}, "trial": [""]})
        self._noise: list[Span] = []
        self.time = self._scatter("Over time", "time in the trial (s)", "t_s")
        self.along = self._scatter("Along a variable", "", "along")
        self.trial = self._scatter("By trial", "trial, by number from 0", "number")
        self.floor = _figure(
            "On the floor: the larger, the worse", "x, east (m)", "y, north (m)", tools=_TOOLS, **_FLOOR
        )
        self._dots(self.floor, "x_m", "y_m", "size")
        self.all = (self.time, self.along, self.trial, self.floor)

    def _scatter(self, title: str, x: str, column: str) -> Any:
        made = _figure(title, x, "position error (mm)", tools=_TOOLS)
        self._dots(made, column, "error_mm", 6)
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
        self.along.xaxis.axis_label = variable
        self.along.title.text = f"Along {variable}"
        for span in self._noise:
            span.location = 1e3 * noise_floor_m if np.isfinite(noise_floor_m) else 0
