"""What every picture of the page has: axes with units, tools, and paths thinned to what a screen can show."""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.plotting import figure

from bns.diagnose.data.tracks import Array

SELECTING = "box_select,lasso_select,tap,pan,wheel_zoom,reset"
FLOOR: dict[str, Any] = {"match_aspect": True, "aspect_scale": 1}
EAST_NORTH = ("x, east (m)", "y, north (m)")
_MOST_POINTS = 4000
"""More of a path no screen shows."""


def blank(title: str, x: str, y: str, tools: str = "pan,wheel_zoom,reset", height: int = 300, **more: Any) -> Any:
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
        **drag,
        **more,
    )
    made.toolbar.logo = None
    made.title.text_font_size = "12px"
    return made


def legend_above(figure: Any) -> None:
    """Inside it would cover where some line runs."""
    figure.add_layout(figure.legend[0], "above")
    figure.legend.orientation, figure.legend.border_line_alpha, figure.legend.padding = "horizontal", 0.0, 2


def drawable(points: Array) -> Array:
    """Every so-manieth point, the last one too."""
    every = max(1, -(-len(points) // _MOST_POINTS))
    return points if every == 1 else np.concatenate([points[::every], points[-1:]])
