"""Runs of a sweep: a dot each, parallel coordinates, and curves over evaluations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from bokeh.models import ColumnDataSource, CustomJS, FixedTicker, HoverTool

from bns.app.figures.common import blank, entitle, legend_above
from bns.plotting.style import BLUE, GREY, OKABE_ITO, RED

SUCCEEDED, FAILED = OKABE_ITO[2], RED
COLOURS = "Green (dots: circles): success at the end. Orange (dots: triangles): no success."
MOST_DOTS, MOST_LINES = 20_000, 1_500
"""More of them no screen shows apart; the figure's title says how many are drawn."""


_MOST_LETTERS = 12
"""Of the name at the end of an axis; the filters have the whole of it."""

_POINTED = """
const [dot] = cb_data.index.indices
clearTimeout(window.bnsPointed)
if (dot === undefined) return
const run = dots.data.run[dot], what = dots.data.what[dot]
window.bnsPointed = setTimeout(() => { if (pointed.data.run[0] !== run) pointed.data = {run: [run], what: [what]} }, 200)
"""
"""A dot that the mouse only passes is not told of."""


class RunsFigure:
    """A dot a run; ``picked`` is told the run whose dot is clicked, ``hovered`` the one pointed at, and what is known of it."""

    def __init__(self, picked: Callable[[str], None], hovered: Callable[[str, str], None]) -> None:
        nothing = {"x": [0.0], "y": [0.0], "run": [""], "what": [""], "color": [SUCCEEDED], "marker": ["circle"]}
        self.source = ColumnDataSource(nothing)
        self.figure: Any = blank("", "", "", tools="tap,pan,wheel_zoom,box_zoom,reset", height=360)
        dots = self.figure.scatter(
            "x", "y", source=self.source, size=8, color="color", marker="marker", fill_alpha=0.55, nonselection_fill_alpha=0.15
        )
        self.figure.add_tools(HoverTool(renderers=[dots], tooltips=[("run", "@run"), ("", "@what")]))
        pointed = ColumnDataSource({"run": [""], "what": [""]})
        tell = CustomJS(args={"dots": self.source, "pointed": pointed}, code=_POINTED)
        self.figure.select_one(HoverTool).callback = tell
        pointed.on_change("data", lambda _a, _o, new: hovered(str(new["run"][0]), str(new["what"][0])))
        self.source.selected.on_change("indices", lambda _a, _o, new: self._tell(new, picked))

    def _tell(self, indices: Sequence[int], picked: Callable[[str], None]) -> None:
        if indices:
            picked(str(self.source.data["run"][indices[0]]))

    def fill(self, rows: pd.DataFrame, x: tuple[str, str], y: tuple[str, str], varied: Sequence[str]) -> None:
        """``x``, ``y``: column and words. Green circles: the fittest succeeds at the end."""
        shown = rows.iloc[:: max(1, -(-len(rows) // MOST_DOTS))]
        what = [
            ", ".join(f"{name} {value}" for name, value in zip(varied, row, strict=True))
            for row in shown[list(varied)].values
        ]
        names = shown["task"] + ", seed " + shown["seed"].astype(str)
        self.source.selected.indices = []
        self.source.data = {
            "x": shown[x[0]].astype(float).to_numpy(),
            "y": shown[y[0]].astype(float).to_numpy(),
            "run": shown["run_id"].to_numpy(),
            "what": [f"{name}; {text}" if text else name for name, text in zip(names, what, strict=True)],
            "color": np.where(shown["success"], SUCCEEDED, FAILED),
            "marker": np.where(shown["success"], "circle", "triangle"),
        }
        self.figure.xaxis.axis_label, self.figure.yaxis.axis_label = x[1], y[1]
        drawn = f", {len(shown)} of them drawn" if len(shown) < len(rows) else ""
        entitle(self.figure, f"{len(rows)} runs{drawn}, one dot per run")


class ParallelFigure:
    """A line a run across all that varies and the outcomes; each axis from its smallest value to its largest."""

    def __init__(self) -> None:
        self.source = ColumnDataSource({"x": [[0.0]], "y": [[0.0]], "color": [SUCCEEDED]})
        self._ends = ColumnDataSource({"x": [0.0], "y": [0.0], "text": [""], "align": ["left"]})
        self.figure: Any = blank("", "", "", height=460, y_range=(-0.6, 1.6))
        self.figure.multi_line("x", "y", source=self.source, color="color", line_alpha=0.25)
        look: dict[str, Any] = {"text_font_size": "11px", "text_align": "align", "text_baseline": "middle"}
        # Upright: side by side they would run into each other on a narrow screen.
        self.figure.text("x", "y", "text", source=self._ends, angle=np.pi / 2, **look)
        self.figure.yaxis.visible = False
        self.figure.x_range.range_padding = 0.25  # the names of the axes go down to the left
        self.figure.xaxis.major_label_orientation = 0.5

    def fill(self, rows: pd.DataFrame, axes: Mapping[str, str]) -> None:
        """``axes``: column -> words."""
        shown = rows.iloc[:: max(1, -(-len(rows) // MOST_LINES))]
        heights, low, high = [], [], []
        for name in axes:
            values, ends = _heights(shown[name])
            heights.append(values)
            low.append(ends[0])
            high.append(ends[1])
        lines = np.array(heights, dtype=float).T
        places = list(range(len(axes)))
        self.source.data = {
            "x": [places] * len(lines),
            "y": [list(line) for line in lines],
            "color": list(np.where(shown["success"], SUCCEEDED, FAILED)),
        }
        self._ends.data = {
            "x": [*places, *places],
            "y": [-0.03] * len(places) + [1.03] * len(places),
            "text": [*low, *high],
            "align": ["right"] * len(places) + ["left"] * len(places),
        }
        self.figure.xaxis.ticker = FixedTicker(ticks=places)
        self.figure.xaxis.major_label_overrides = dict(enumerate(axes.values()))
        drawn = f"{len(shown)} of {len(rows)} runs drawn" if len(shown) < len(rows) else f"{len(rows)} runs"
        entitle(self.figure, f"{drawn}, one line per run")


def _heights(column: pd.Series) -> tuple[np.ndarray, tuple[str, str]]:
    """Values as heights from 0 to 1, and what the ends are."""
    if column.dtype == bool:
        return column.to_numpy(dtype=float), ("no", "yes")
    if not pd.api.types.is_numeric_dtype(column):
        names = sorted(column.astype(str).unique())
        place = {name: i / max(len(names) - 1, 1) for i, name in enumerate(names)}
        return np.array([place[str(v)] for v in column]), (_short(names[0]), _short(names[-1])) if names else ("", "")
    values = column.to_numpy(dtype=float)
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    return (values - low) / (high - low if high > low else 1.0), (f"{low:.3g}", f"{high:.3g}")


def _short(name: str) -> str:
    """Its end, which tells files apart."""
    return name if len(name) <= _MOST_LETTERS else f"…{name[1 - _MOST_LETTERS :]}"


class CurveFigure:
    """One quantity over the evaluations of two runs, and of the one under the pointer."""

    def __init__(self) -> None:
        self.figure: Any = blank("", "evaluation", "", height=300)
        self._sources = [ColumnDataSource({"x": [0.0], "y": [0.0]}) for _ in range(3)]
        names = ("run A", "run B", "under the pointer")
        looks = zip(self._sources, (BLUE, RED, GREY), ("solid", "dashed", "dotted"), names, strict=True)
        self._lines = [
            self.figure.line("x", "y", source=source, color=color, line_dash=dash, line_width=2, legend_label=name, visible=False)
            for source, color, dash, name in looks
        ]
        for axis in (self.figure.x_range, self.figure.y_range):
            axis.only_visible = True
        legend_above(self.figure)

    def fill(self, which: int, evaluations: Any, values: Any) -> None:
        """Run A (0), B (1), or the one under the pointer (2)."""
        self._sources[which].data = {"x": np.asarray(evaluations), "y": np.asarray(values, dtype=float)}
        self._lines[which].visible = True

    def hide(self, which: int) -> None:
        """No run is chosen there."""
        self._lines[which].visible = False

    @property
    def empty(self) -> bool:
        """Is no curve drawn?"""
        return not any(line.visible for line in self._lines)

    def name(self, words: str) -> None:
        """What is drawn."""
        self.figure.yaxis.axis_label = words
        entitle(self.figure, f"{words} of the fittest")
