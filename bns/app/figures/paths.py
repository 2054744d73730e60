"""Measured and predicted paths, one trial or all."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, HoverTool

from bns.app.figures.common import EAST_NORTH, FLOOR, SELECTING, blank, drawable, entitle, legend_above
from bns.diagnose.data.bodies.cycles import CycleTracks
from bns.diagnose.data.bodies.joints import JointTracks
from bns.diagnose.data.tracks import Array, Tracks
from bns.plotting.style import BLUE, OKABE_ITO, RED

MARKERS = ("yellow", "green")
"""Of a snake, in the order of `CycleTracks.markers_m`."""


_JUST = 1e-9
"""Both ends of a stretch are part of it."""


class PathFigure:
    """Measured (solid) and predicted (dashed) path of one trial, and where both are at a time."""

    def __init__(self, title: str, beside: PathFigure | None = None) -> None:
        ranges: dict[str, Any] = (
            {} if beside is None else {"x_range": beside.figure.x_range, "y_range": beside.figure.y_range}
        )
        self.figure: Any = blank(title, EAST_NORTH[0], EAST_NORTH[1], height=340, **ranges, **FLOOR)
        self._lines = [ColumnDataSource({"x": [0.0], "y": [0.0]}) for _ in range(2)]
        self._dots = ColumnDataSource({"x": [], "y": [], "color": []})
        self._times, self._poses = np.zeros(0), (np.zeros((0, 3)), np.zeros((0, 3)))
        for source, color, dash, name in zip(
            self._lines, (BLUE, RED), ("solid", "dashed"), ("measured", "predicted"), strict=True
        ):
            self.figure.line("x", "y", source=source, color=color, line_dash=dash, line_width=2, legend_label=name)
        self._marked = ColumnDataSource({"x": [], "y": [], "color": []})
        self.figure.multi_line("x", "y", source=self._marked, line_color="color", line_width=7, line_alpha=0.45)
        self.figure.scatter("x", "y", source=self._dots, color="color", size=11, line_color="black")
        legend_above(self.figure)

    def fill(self, title: str, t_s: Array, measured: Array, predicted: Array) -> None:
        """Poses (frames, 3) of both at the times ``t_s`` (frames,)."""
        entitle(self.figure, title)
        for source, poses in zip(self._lines, (measured, predicted), strict=True):
            shown = drawable(poses)
            if not (np.array_equal(source.data["x"], shown[:, 0]) and np.array_equal(source.data["y"], shown[:, 1])):
                source.data = {"x": shown[:, 0], "y": shown[:, 1]}  # what is drawn already is not sent again
        self._times, self._poses = t_s, (measured, predicted)

    def mark(self, stretches: Sequence[tuple[float, float]]) -> None:
        """Of both paths what lies within these times (from, to; s)."""
        rows = [np.searchsorted(self._times, (a - _JUST, b + _JUST)) for a, b in stretches]
        parts = [(poses[a:b], color) for a, b in rows for poses, color in zip(self._poses, (BLUE, RED), strict=True)]
        self._marked.data = {
            "x": [p[:, 0] for p, _ in parts],
            "y": [p[:, 1] for p, _ in parts],
            "color": [color for _, color in parts],
        }

    def at(self, t_s: float) -> None:
        """Dots where both are at a time (s)."""
        if not len(self._times):
            return
        frame = int(np.searchsorted(self._times, t_s).clip(max=len(self._times) - 1))
        places = [poses[frame] for poses in self._poses]
        data = {"x": [float(p[0]) for p in places], "y": [float(p[1]) for p in places], "color": [BLUE, RED]}
        if dict(self._dots.data) != data:
            self._dots.data = data


def paths_of(tracks: Tracks) -> list[tuple[str, str, Array]]:
    """Trial, marker ("" for the robot itself) and places (n, 2 or 3), m; NaN where it goes on elsewhere."""
    if isinstance(tracks, CycleTracks):
        seen = [_cycles(tracks, trial) for trial in range(len(tracks))]
        return [(name, site, seen[i][:, k]) for i, name in enumerate(tracks.names) for k, site in enumerate(MARKERS)]
    if isinstance(tracks, JointTracks):
        sites = [(site, tracks.points_m[:, k]) for k, site in enumerate(tracks.sites)]
    else:
        sites = [("", tracks.pose)]
    breaks = np.zeros(len(tracks.t_s), dtype=bool) if tracks.jumped is None else tracks.jumped
    return [
        (name, site, np.insert(places[a:b], np.flatnonzero(breaks[a:b]), np.nan, axis=0))
        for name, (a, b) in zip(tracks.names, pairwise(tracks.first), strict=True)
        for site, places in sites
    ]


def _cycles(tracks: CycleTracks, trial: int) -> Array:
    """Both markers (n, 2, 2) at the begin of each cycle, in it where a camera saw them, and at its end."""
    parts = []
    for frame in range(tracks.first[trial], tracks.first[trial + 1], 2):
        inner = [tracks.between[frame // 2][1]] if tracks.between else []
        parts += [tracks.markers_m[frame][None], *inner, tracks.markers_m[frame + 1][None]]
    return np.concatenate([np.zeros((0, 2, 2)), *parts])


_MOST_OF_ALL, _LEAST_OF_A_PATH = 60_000, 12
"""Points: more of all paths together make a browser slow; fewer show no curve."""


class LogFigure:
    """All measured paths, what was found odd on them, and trials that can be selected."""

    def __init__(self, title: str = "", height: int = 420) -> None:
        self.paths = ColumnDataSource({"x": [[0.0]], "y": [[0.0]], "trial": [""], "marker": [""], "color": [BLUE]})
        self.findings = ColumnDataSource({"x": [], "y": [], "text": []})
        self._title = title or "Measured paths; crosses: findings"
        self.figure = blank(
            self._title,
            *EAST_NORTH,
            tools=SELECTING,
            height=height,
            **FLOOR,
        )
        lines = self.figure.multi_line(
            "x", "y", source=self.paths, color="color", line_width=1.5, nonselection_alpha=0.15
        )
        self.figure.add_tools(HoverTool(renderers=[lines], tooltips=[("trial", "@trial"), ("of", "@marker")]))
        marks = self.figure.scatter(
            "x", "y", source=self.findings, marker="x", size=12, line_width=3, color="black", nonselection_alpha=1.0
        )
        self.figure.add_tools(HoverTool(renderers=[marks], tooltips=[("", "@text")]))

    def fill(self, paths: Sequence[tuple[str, str, Array]], findings: dict[str, list[Any]]) -> None:
        """As `paths_of` gives them: a colour a trial, or a marker; findings as x, y, text.

        Of more paths than can be told apart every so-many-th is drawn, which the title says.
        """
        every = max(1, -(-len(paths) * _LEAST_OF_A_PATH // _MOST_OF_ALL))
        entitle(self.figure, self._title + (f"; one of {every} paths is drawn" if every > 1 else ""))
        paths = paths[::every]
        most = max(_LEAST_OF_A_PATH, _MOST_OF_ALL // max(len(paths), 1))
        thin = [p[:: max(1, -(-len(p) // most))] for _, _, p in paths]
        sites = list(dict.fromkeys(site for _, site, _ in paths))
        trials = list(dict.fromkeys(name for name, _, _ in paths))
        look = [sites.index(site) if len(sites) > 1 else trials.index(name) for name, site, _ in paths]
        self.paths.selected.indices = []
        self.paths.data = {
            "x": [p[:, 0] for p in thin],
            "y": [p[:, 1] for p in thin],
            "trial": [name for name, _, _ in paths],
            "marker": [site or "robot" for _, site, _ in paths],
            "color": [OKABE_ITO[i % len(OKABE_ITO)] for i in look],
        }
        self.findings.data = findings
