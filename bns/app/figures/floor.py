"""The floor: goals and a run's path, the arena drawn with the mouse, proposed trials; and the chance of a decision by minutes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from bokeh.events import SelectionGeometry
from bokeh.models import ColumnDataSource

from bns.app.figures.common import EAST_NORTH, FLOOR, blank, drawable, entitle
from bns.diagnose.data.tracks import Array
from bns.plotting.style import BLUE, GREY, OKABE_ITO, RED

_DASHES = ("solid", "dashed", "dotdash", "dotted")
Sides = tuple[float, float, float, float]
"""Lowest and highest x, lowest and highest y (m)."""


class GoalFigure:
    """The goals in their order, where the robot drove (solid), and where its networks expected it (dashed)."""

    def __init__(self) -> None:
        self.figure: Any = blank("", *EAST_NORTH, height=360, **FLOOR)
        self._goals = ColumnDataSource({"x": [], "y": [], "text": []})
        self._lines = [ColumnDataSource({"x": [0.0], "y": [0.0]}) for _ in range(2)]
        self.figure.scatter("x", "y", source=self._goals, size=12, fill_color=None, line_color=GREY, line_width=2)
        self.figure.text("x", "y", "text", source=self._goals, x_offset=9, y_offset=-4, text_font_size="12px")
        looks = zip(self._lines, (BLUE, RED), ("solid", "dashed"), ("driven", "expected by the networks"), strict=True)
        for source, color, dash, name in looks:
            self.figure.line("x", "y", source=source, color=color, line_dash=dash, line_width=2, legend_label=name)
        self.figure.legend.location, self.figure.legend.background_fill_alpha = "top_left", 0.6

    def fill(self, title: str, goals_m: Array, driven: Array, expected: Array) -> None:
        """Goals (goals, 2) and poses (points, 2 or 3), m."""
        entitle(self.figure, title)
        numbers = [str(n + 1) for n in range(len(goals_m))]
        self._goals.data = {"x": goals_m[:, 0], "y": goals_m[:, 1], "text": numbers}
        for source, poses in zip(self._lines, (driven, expected), strict=True):
            shown = drawable(poses)
            source.data = {"x": shown[:, 0], "y": shown[:, 1]}


_DRAG = "Drag to draw the arena"


class ArenaFigure:
    """Where the robot was seen, the arena as a rectangle that the mouse draws, and what explanations expect of one trial."""

    def __init__(self, drawn: Callable[[Sides], None]) -> None:
        self.figure: Any = blank(
            _DRAG, *EAST_NORTH, tools="box_select,pan,wheel_zoom,reset", height=360, **FLOOR
        )
        self._seen = ColumnDataSource({"x": [], "y": []})
        self._arena = ColumnDataSource({"left": [], "right": [], "bottom": [], "top": []})
        self._paths = ColumnDataSource({"x": [[0.0]], "y": [[0.0]], "color": [BLUE], "dash": ["solid"], "name": [""]})
        self._dots = ColumnDataSource({"x": [], "y": [], "color": []})
        look = {"nonselection_fill_alpha": 0.35, "nonselection_line_alpha": 0.35}
        self.figure.scatter("x", "y", source=self._seen, size=2, color=GREY, alpha=0.35, **look)
        self.figure.quad(
            source=self._arena,
            fill_alpha=0.06,
            nonselection_fill_alpha=0.06,
            fill_color=BLUE,
            line_color=BLUE,
            line_dash="dotted",
        )
        self.figure.multi_line(
            "x",
            "y",
            source=self._paths,
            color="color",
            line_dash="dash",
            line_width=3,
            nonselection_line_alpha=1.0,
            legend_field="name",
        )
        self.figure.scatter("x", "y", source=self._dots, color="color", size=9, nonselection_fill_alpha=1.0)
        self.figure.legend.location, self.figure.legend.background_fill_alpha = "top_left", 0.6
        self.figure.legend.visible = False
        self._times = np.zeros(0)
        self._poses: list[tuple[Array, str]] = []
        self.figure.on_event(SelectionGeometry, lambda event: self._box(event, drawn))

    def _box(self, event: Any, drawn: Callable[[Sides], None]) -> None:
        g = event.geometry
        if event.final and g.get("type") == "rect":
            x, y = sorted((g["x0"], g["x1"])), sorted((g["y0"], g["y1"]))
            drawn((float(x[0]), float(x[1]), float(y[0]), float(y[1])))

    def clear(self) -> None:
        """No trial."""
        self.trial(_DRAG, np.zeros(0), [], [])
        self._dots.data = {"x": [], "y": [], "color": []}

    def seen(self, places: Array) -> None:
        """Where the robot was (points, 2), m."""
        shown = drawable(places)
        self._seen.data = {"x": shown[:, 0], "y": shown[:, 1]}

    def arena(self, sides: Sides) -> None:
        """The rectangle."""
        self._arena.data = dict(zip(("left", "right", "bottom", "top"), ([s] for s in sides), strict=True))

    def trial(self, title: str, t_s: Array, paths: Sequence[Array], names: Sequence[str]) -> None:
        """What each explanation expects of a trial: poses (frames, 3) at the times ``t_s``."""
        colors = [OKABE_ITO[i % len(OKABE_ITO)] for i in range(len(paths))]
        entitle(self.figure, title)
        self.figure.legend.visible = bool(paths)
        self._paths.data = {
            "x": [p[:, 0] for p in paths],
            "y": [p[:, 1] for p in paths],
            "color": colors,
            "dash": [_DASHES[i % len(_DASHES)] for i in range(len(paths))],
            "name": list(names),
        }
        self._times, self._poses = t_s, list(zip(paths, colors, strict=True))

    def at(self, t_s: float) -> None:
        """Dots where each explanation expects the robot at a time (s)."""
        if not len(self._times):
            return
        frame = int(np.searchsorted(self._times, t_s).clip(max=len(self._times) - 1))
        places = [(path[min(frame, len(path) - 1)], color) for path, color in self._poses]
        self._dots.data = {
            "x": [p[0] for p, _ in places],
            "y": [p[1] for p, _ in places],
            "color": [c for _, c in places],
        }


class PowerFigure:
    """The chance that each pair of explanations is decided, against minutes of driving."""

    def __init__(self) -> None:
        self.figure: Any = blank(
            "Chance of a decision", "minutes of driving", "chance (fraction)", height=260, y_range=(0, 1.02)
        )
        self._lines = ColumnDataSource({"x": [[0.0]], "y": [[0.0]], "color": [BLUE], "dash": ["solid"], "name": [""]})
        self.figure.multi_line(
            "x", "y", source=self._lines, color="color", line_dash="dash", line_width=2, legend_field="name"
        )
        self.figure.legend.location, self.figure.legend.background_fill_alpha = "bottom_right", 0.6

    def fill(self, curves: Sequence[Sequence[tuple[float, float]]], names: Sequence[str]) -> None:
        """For each pair: minutes and chance."""
        self._lines.data = {
            "x": [[m for m, _ in curve] for curve in curves],
            "y": [[p for _, p in curve] for curve in curves],
            "color": [OKABE_ITO[i % len(OKABE_ITO)] for i in range(len(curves))],
            "dash": [_DASHES[i % len(_DASHES)] for i in range(len(curves))],
            "name": list(names),
        }
