"""Figure 4.16: the potential success indicator, success within the widest goal radius, of the ten best combinations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from analysis.coverage import coverage
from analysis.figure_result import FigureResult
from analysis.intervals import BOOTSTRAP, bootstrap
from analysis.labels import task_title
from analysis.outcomes import by_seed, radii_cm
from analysis.ranking import any_of, by_seed_array, extremes, ranking
from analysis.results import NoDataError, Results
from analysis.selection import Selection, selections
from bns.plotting.style import GREY, lettered, note, ordered_styles, panels, style

NAME = "potential-success"
PAPER = "figure 4.16"
RADIUS_CM = 20


def draw(store: Results) -> list[FigureResult]:
    robots = [chosen for chosen in selections(store) if RADIUS_CM in radii_cm(store, chosen)]
    if not robots:
        raise NoDataError(f"no finished run has goal points with a radius of {RADIUS_CM} cm; run bns sweep khepera-small")
    return [_draw(store, chosen) for chosen in robots]


def curve(store: Results, chosen: Selection, task: str, cells: pd.DataFrame) -> pd.DataFrame:
    """Share of runs of these combinations that succeed within 20 cm after each evaluation, with its interval."""
    rows = by_seed(store, chosen, ("evaluation",), f"task = '{task}' AND ({any_of(cells)})")
    (sums, evaluations), (counts, _) = (by_seed_array(rows, name) for name in ("successes_20cm", "runs"))
    low, high = bootstrap(sums, counts)
    share = sums.sum(axis=0) / counts.sum(axis=0)
    return pd.DataFrame({"task": task, "evaluation": evaluations, "share": share, "low": low, "high": high})


def each_curve(store: Results, chosen: Selection, task: str, cells: pd.DataFrame) -> pd.DataFrame:
    """The same share of each combination: combination (its place in the ranking, from 1), evaluation, share."""
    curves = [curve(store, chosen, task, cells.iloc[[place]]).assign(combination=place + 1) for place in range(len(cells))]
    return pd.concat(curves)[["combination", "evaluation", "share"]]


@style()
def _draw(store: Results, chosen: Selection) -> FigureResult:
    rows = ranking(store, chosen)
    tops = {task: extremes(rows, task)[0] for task in chosen.tasks if (rows.task == task).sum() > 1}
    if not tops:
        raise NoDataError("no task has two combinations with enough runs; run bns sweep khepera-small")
    lines = {task: curve(store, chosen, task, cells) for task, cells in tops.items()}
    singles = {task: each_curve(store, chosen, task, cells) for task, cells in tops.items()}
    figure, axes = panels(len(tops), 2.6)
    for number, (look, task) in enumerate(zip(ordered_styles(len(tops)), tops, strict=True)):
        title = lettered(number, len(tops), task_title(chosen.robot, task))
        _panel(axes[number, 0], lines[task], singles[task], look, title)
    axes[0, 0].set_ylabel(f"runs within {RADIUS_CM} cm (%)")
    n, said = int(sum(cells.runs.sum() for cells in tops.values())), coverage(store, chosen.sweeps, chosen.n)
    thin = "thin: each combination; thick: all of them"
    note(figure, "; ".join((f"{n:,} runs in the best combinations", thin, *said.missing, f"bands: {BOOTSTRAP}")) + ".")
    shows = (
        f"Fraction of runs whose fittest controller visits all goals within {RADIUS_CM} cm, of the best "
        f"{max(map(len, tops.values()))} combinations of each task, each by itself and all together; bands are {BOOTSTRAP}. "
        f"n = {n:,} runs of {chosen.source}. The best are picked by success at the last evaluation, so their success "
        "is overestimated."
    )
    see = " ".join(_half(task_title(chosen.robot, task), line) for task, line in lines.items())
    return FigureResult(
        f"{NAME}-{chosen.robot}", "Potential success of the best combinations", figure, shows, n, chosen.sweeps,
        (*said.missing, *chosen.left_out), see=see, data=pd.concat(lines.values()),
    )  # fmt: skip


def _panel(ax: Axes, line: pd.DataFrame, singles: pd.DataFrame, look: dict[str, Any], title: str) -> None:
    for _, single in singles.groupby("combination"):
        ax.plot(single.evaluation, 100 * single.share, color=look["color"], linewidth=0.6, alpha=0.45, label="_each")
    ax.fill_between(line.evaluation, 100 * line.low, 100 * line.high, color=look["color"], alpha=0.18, linewidth=0)
    ax.plot(line.evaluation, 100 * line.share, color=look["color"], linewidth=2, label="all of them")
    ax.axhline(50, color=GREY, linewidth=0.8)
    ax.set(ylim=(-2, 102), xlim=(0, line.evaluation.max() + 1), xlabel="evaluation in the world", title=title)
    ax.xaxis.set_major_locator(MaxNLocator(6, integer=True, steps=[1, 2, 5, 10]))


def _half(title: str, line: pd.DataFrame) -> str:
    reached = line.evaluation[np.asarray(line.share >= 0.5)]
    return f"{title}: half of the runs by evaluation {reached.iloc[0]}." if len(reached) else f"{title}: never half of the runs."
