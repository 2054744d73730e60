"""What every picture of the page has: axes with units, tools, and paths thinned to what a screen can show."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
from bokeh.plotting import figure

from bns.diagnose.data.tracks import Array

SELECTING = "box_select,lasso_select,tap,pan,wheel_zoom,reset"
FLOOR: dict[str, Any] = {"match_aspect": True, "aspect_scale": 1}
EAST_NORTH = ("x, east (m)", "y, north (m)")
_MOST_POINTS = 4000
"""More of a path no screen shows."""
_TITLE_CHARACTERS = 44
"""Of a line of a title: what a window of 400 pixels has room for."""
_HEIGHT, _LETTER = 300, 7
"""Pixels: of a figure, and of a letter of its labels."""
_UPRIGHT_CHARACTERS = 4
"""Labels with more stand upright: side by side they would run into each other."""


def blank(title: str, x: str, y: str, tools: str = "pan,wheel_zoom,reset", height: int = _HEIGHT, **more: Any) -> Any:
    """An empty figure that takes the width there is."""
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
        toolbar_sticky=False,  # in a line of its own: beside a title, its icons lie over it where the window is narrow
        **drag,
        **more,
    )
    made.toolbar.logo = None
    made.title.text_font_size = made.axis.major_label_text_font_size = made.axis.axis_label_text_font_size = "13px"
    entitle(made, title)
    return made


def entitle(figure: Any, title: str) -> None:
    """A title in as many lines as a narrow window needs: Bokeh cuts what is too long."""
    lines = [line for part in title.split("; ") for line in textwrap.wrap(part, _TITLE_CHARACTERS)]
    figure.title.text = "\n".join(lines)


def label_ticks(figure: Any, names: dict[float, str]) -> None:
    """Names in the place of numbers along the horizontal axis; long ones take their room from no plot."""
    longest = max(map(len, names.values()), default=0)
    upright = longest > _UPRIGHT_CHARACTERS
    figure.xaxis.major_label_overrides = names
    figure.xaxis.major_label_orientation = "vertical" if upright else "horizontal"
    figure.height = _HEIGHT + (_LETTER * longest if upright else 0)


def legend_above(figure: Any) -> None:
    """Inside it would cover where some line runs."""
    figure.add_layout(figure.legend[0], "above")
    figure.legend.orientation, figure.legend.border_line_alpha, figure.legend.padding = "horizontal", 0.0, 2


def drawable(points: Array) -> Array:
    """Every so-manieth point, the last one too."""
    every = max(1, -(-len(points) // _MOST_POINTS))
    return points if every == 1 else np.concatenate([points[::every], points[-1:]])
