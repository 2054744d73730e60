"""Figures 4.11 (Khepera) and 5.26 (snake): how wrong the networks are about the fittest controller, against diversity."""

from __future__ import annotations

import numpy as np
import pandas as pd

from analysis.figure_result import FigureResult
from analysis.intervals import mean_interval
from analysis.labels import TITLES, task_title
from analysis.results import Results
from analysis.scatter import Panel, combinations, described, intervals_shown, scatter_figure
from analysis.selection import Selection, selections
from bns.plotting.style import style

NAME = "fitness-error-by-diversity"
PAPER = "figures 4.11 and 5.26"
COLOUR = "population_size"
LONGEST = 2.5
"""An axis ends at this many times the largest mean: intervals of a few runs would press all dots onto the other axis."""


def draw(store: Results) -> list[FigureResult]:
    return [_draw(store, chosen) for chosen in selections(store)]


@style()
def _draw(store: Results, chosen: Selection) -> FigureResult:
    rows, thin = combinations(store, chosen)
    low, high = mean_interval(rows.fitness_error, rows.fitness_error_sd, rows.runs)
    rows = rows.assign(y=rows.fitness_error, low=np.maximum(low, 0), high=high)
    tasks = [task for task in chosen.tasks if task in set(rows.task)]
    shown = [Panel(task_title(chosen.robot, task), rows[rows.task == task]) for task in tasks]
    figure, axes = scatter_figure(shown, COLOUR, "mean fitness error (1/m)")
    for ax, panel in zip(axes, shown, strict=True):
        ax.set_ylim(0, min(ax.get_ylim()[1], LONGEST * panel.rows.y.max()) or None)
    what = (
        "Mean absolute difference between the fitness of the fittest controller in simulation and in the world at the last "
        f"evaluation, against the mean diversity of the populations then, by {TITLES[COLOUR]}; "
        + intervals_shown(rows, "Student's 95 % intervals of the mean")
    )
    return described(
        store, chosen, figure, rows, name=NAME, title="Fitness error against diversity", what=what,
        intervals=f"Student's 95 % intervals of the mean, cut at {LONGEST:g} times the largest", thin=thin,
        see=_in_words(chosen, rows),
    )  # fmt: skip


def _in_words(chosen: Selection, rows: pd.DataFrame) -> str:
    """Rank correlation of error and diversity over the combinations of each task."""
    from scipy.stats import spearmanr  # noqa: PLC0415  # slow to load

    said = []
    for task, own in rows.dropna(subset=["diversity", "fitness_error"]).groupby("task"):
        if len(own) > 2 and own.diversity.nunique() > 1 and own.fitness_error.nunique() > 1:
            rank = spearmanr(own.diversity, own.fitness_error).statistic
            said.append(f"{task_title(chosen.robot, task)}: rank correlation {rank:+.2f} over {len(own)} combinations.")
    return " ".join(said)
