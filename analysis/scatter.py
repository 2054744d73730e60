"""A dot a combination against the diversity of its populations: what figures 4.11, 4.12 and 5.26 to 5.28 share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.coverage import coverage
from analysis.figure_result import FigureResult
from analysis.intervals import mean_interval
from analysis.labels import SHORT, TITLES, counted, each, valued
from analysis.outcomes import at_the_end, fewest
from analysis.results import BEGIN, NoDataError, Results, remembered
from analysis.selection import Selection
from bns.plotting.style import lettered, note, ordered_styles, panels, style

CROWD = 60
"""From this many dots a panel on, means of groups are drawn in place of each dot's interval: nobody could tell these apart."""
LEGEND_PT = 6.0
"""Size of a marker in the legend, however small the dots are: its colour and shape must be told."""
GROUPS = 5
"""Groups of equally many combinations, by diversity, whose means are drawn."""


@dataclass(frozen=True)
class Panel:
    """One panel: the rows of one task with columns diversity, y, low and high."""

    title: str
    rows: pd.DataFrame


@remembered
def combinations(store: Results, chosen: Selection) -> tuple[pd.DataFrame, int]:
    """Every combination with enough runs at its last evaluation, and how many have fewer.

    Raises:
        NoDataError: none has enough yet.
    """
    found, least = at_the_end(store, chosen), fewest(store, chosen)
    rows = found[found.runs >= least]
    if rows.empty:
        raise NoDataError(
            f"no combination has {least} finished runs yet (the most is {found.runs.max()}); "
            f"run {BEGIN}, which continues where it stopped"
        )
    return rows, len(found) - len(rows)


def scatter_figure(shown: Sequence[Panel], parameter: str, label: str) -> tuple[Figure, Sequence[Axes]]:
    """Figure of the panels, coloured by ``parameter``, with one legend for all."""
    values = sorted(set().union(*(panel.rows[parameter] for panel in shown)))
    looks = dict(zip(values, ordered_styles(len(values)), strict=True))
    figure, axes = panels(len(shown), 3.0)
    for number, (panel, ax) in enumerate(zip(shown, axes[:, 0], strict=True)):
        _dots(ax, panel.rows, parameter, looks)
        ax.set_title(lettered(number, len(axes), panel.title))
        ax.set(xlabel="diversity of the population", ylabel=label)
    _legend(figure, axes[:, 0], parameter, values)
    return figure, list(axes[:, 0])


def _dots(ax: Axes, rows: pd.DataFrame, parameter: str, looks: dict[float, dict[str, str]]) -> None:
    for value, dots in rows.groupby(parameter):
        look = {"color": looks[value]["color"], "zorder": 2 + len(looks)}
        small: dict[str, float] = {}
        if len(rows) < CROWD:
            ax.vlines(dots.diversity, dots.low, dots.high, linewidth=1.0, color=look["color"], alpha=0.7)
        else:
            _means(ax, dots, look["color"])
            small = {"markersize": 2.5, "alpha": 0.6}
        ax.plot(
            dots.diversity,
            dots.y,
            marker=looks[value]["marker"],
            linestyle="none",
            markeredgecolor="white",
            markeredgewidth=0.3,
            label=valued(parameter, value),
            **look,
            **small,
        )
    if rows.diversity.notna().any() and rows.diversity.max() > 0:
        ax.set_xlim(0, 1.08 * rows.diversity.max())


def _means(ax: Axes, dots: pd.DataFrame, colour: str) -> None:
    """Mean of each of `GROUPS` groups along the diversity, with its 95 % interval over their combinations."""
    inner = dots.dropna(subset=["diversity", "y"]).sort_values("diversity")
    groups = (inner.iloc[members] for members in np.array_split(np.arange(len(inner)), GROUPS))
    known = [group for group in groups if len(group) > 1]
    if not known:
        return
    x, y = (np.array([group[column].mean() for group in known]) for column in ("diversity", "y"))
    low, high = mean_interval(y, [group.y.std() for group in known], [len(group) for group in known])
    ax.fill_between(x, low, high, color=colour, alpha=0.25, linewidth=0, zorder=20)
    ax.plot(x, y, color=colour, linewidth=1.6, zorder=21)


def intervals_shown(rows: pd.DataFrame, intervals: str) -> str:
    """What bars, or lines and bands, of such a figure are; ``intervals``: those of single combinations."""
    if rows.groupby("task").size().max() < CROWD:
        return f"bars: {intervals}"
    return f"lines: means of {GROUPS} equal groups of combinations by diversity, with Student's 95 % intervals over them"


def _legend(figure: Figure, axes: Sequence[Axes], parameter: str, values: Sequence[float]) -> None:
    named = {}
    for ax in axes:
        named.update(dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True)))
    labels = [valued(parameter, value) for value in values]
    figure.legend(
        [named[label] for label in labels],
        labels,
        loc="outside upper center",
        ncols=len(labels),
        title=TITLES[parameter],
        markerscale=LEGEND_PT / max(min(named[label].get_markersize() for label in labels), 1.0),
        columnspacing=1.0,
        handletextpad=0.1,
    )


@style()
def described(
    store: Results,
    chosen: Selection,
    figure: Figure,
    rows: pd.DataFrame,
    *,
    name: str,
    title: str,
    what: str,
    intervals: str,
    thin: int,
    see: str = "",
) -> FigureResult:
    """The figure with its note and caption; ``what`` begins the caption."""
    said, n = coverage(store, chosen.sweeps, chosen.n), int(rows.runs.sum())
    thinned = (f"{counted(thin, 'combination')} with fewer than {fewest(store, chosen)} runs left out",) if thin else ()
    runs = each(rows.runs.min(), rows.runs.max())
    note(
        figure,
        "; ".join(
            (f"{counted(len(rows), 'dot')} of {runs} each", *said.sentences, *thinned, intervals_shown(rows, intervals))
        )
        + ".",
    )
    shows = (
        f"{what}; one dot per task and combination of {', '.join(SHORT.values())} ({runs} each, n = {n:,} runs of "
        f"{chosen.source})."
    )
    missing = (*said.missing, *thinned, *chosen.left_out)
    return FigureResult(f"{name}-{chosen.robot}", title, figure, shows, n, chosen.sweeps, missing, see=see, data=rows)
