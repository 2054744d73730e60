"""The picture of an effect: its path beside the plain model's, and how far the two are apart."""

from __future__ import annotations

import io

from matplotlib.figure import Figure

from bns.plotting.style import BLUE, GREY, PAGE_IN, RED, style
from site_pages.drives import Demonstration

_DOTS_S = 2.0


@style()
def picture(name: str, shown: Demonstration) -> bytes:
    """An SVG without a date, so that the same code gives the same bytes."""
    figure = Figure(figsize=(PAGE_IN, 2.9))
    path, gap = figure.subplots(1, 2, width_ratios=(1.25, 1))
    path.plot(*shown.plain_m.T, color=GREY, linestyle="--", label="plain model")
    path.plot(*shown.with_effect_m.T, color=BLUE, label=f"with {name}")
    path.plot(*shown.plain_m[0], marker="o", color=GREY, linestyle="", label="start")
    every = round(_DOTS_S / (shown.t_s[1] - shown.t_s[0]))
    for way_m, colour in ((shown.plain_m, GREY), (shown.with_effect_m, BLUE)):
        path.plot(*way_m[every::every].T, marker=".", color=colour, linestyle="")
        path.plot(*way_m[-1], marker="s", color=colour, linestyle="")
    path.set(xlabel="x, east (m)", ylabel="y, north (m)", title=f"Path; a dot every {_DOTS_S:g} s, a square at the end")
    path.set_aspect("equal", adjustable="datalim")
    path.legend(loc="best")
    gap.plot(shown.t_s, 100 * shown.apart_m, color=RED)
    gap.set(xlabel="time (s)", ylabel="distance between the two (cm)", title="How far apart")
    gap.set_ylim(bottom=0)
    out = io.BytesIO()
    figure.savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()
