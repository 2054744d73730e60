"""One trial over time, and the stretch of it that is kept, which the mouse draws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from bokeh.events import SelectionGeometry
from bokeh.models import BoxAnnotation, BoxSelectTool, ColumnDataSource, HoverTool

from bns.app.figures.common import blank, drawable, entitle
from bns.diagnose.data.tracks import Array
from bns.plotting.style import BLUE, GREY, RED

Stretch = tuple[float, float]
"""From one time to another, s."""


class TimeAxisFigure:
    """How far the robot is from where it began, over time; ``brushed`` is told the stretch that the mouse drew."""

    def __init__(self, brushed: Callable[[Stretch], None]) -> None:
        self.figure: Any = blank(
            "", "time in the trial (s)", "distance (m)", tools="xpan,xwheel_zoom,reset", height=220
        )
        brush = BoxSelectTool(dimensions="width")
        self.figure.add_tools(brush)
        self.figure.toolbar.active_drag = brush
        self._line = ColumnDataSource({"t_s": [0.0], "m": [0.0]})
        self._odd = ColumnDataSource({"t_s": [], "m": [], "text": []})
        self.figure.line("t_s", "m", source=self._line, color=BLUE, line_width=2)
        marks = self.figure.scatter("t_s", "m", source=self._odd, marker="x", size=11, line_width=3, color="black")
        self.figure.add_tools(HoverTool(renderers=[marks], tooltips=[("", "@text")]))
        look: dict[str, Any] = {"fill_color": GREY, "fill_alpha": 0.35, "line_color": RED}
        self._before, self._after = BoxAnnotation(right=0.0, **look), BoxAnnotation(left=0.0, **look)
        for box in (self._before, self._after):
            box.visible = False
            self.figure.add_layout(box)
        self.figure.on_event(SelectionGeometry, lambda event: self._box(event, brushed))

    def fill(self, title: str, t_s: Array, pose: Array, odd: Sequence[tuple[float, str]]) -> None:
        """Times (frames,) and poses (frames, 3) of a trial; findings: time and text."""
        entitle(self.figure, f"{title}; distance from its first pose")
        away = np.hypot(*(pose[:, :2] - pose[:1, :2]).T) if len(pose) else np.zeros(0)
        shown = drawable(np.column_stack([t_s, away]))
        self._line.data = {"t_s": shown[:, 0], "m": shown[:, 1]}
        times = [t for t, _ in odd]
        heights = np.interp(times, t_s, away) if len(t_s) else np.zeros(len(times))
        self._odd.data = {"t_s": times, "m": heights, "text": [text for _, text in odd]}

    def keep(self, stretch: Stretch | None) -> None:
        """What lies outside is shaded; None: all is kept."""
        for box in (self._before, self._after):
            box.visible = stretch is not None
        if stretch is not None:
            self._before.right, self._after.left = stretch

    def _box(self, event: Any, brushed: Callable[[Stretch], None]) -> None:
        g = event.geometry
        if event.final and g.get("type") == "rect":
            low, high = sorted((float(g["x0"]), float(g["x1"])))
            brushed((low, high))
