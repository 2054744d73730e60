"""Figures 4.12 (Khepera) and 5.27 (snake): success at the last evaluation against diversity, a dot a combination."""

from __future__ import annotations

import pandas as pd

from analysis.figure_result import FigureResult
from analysis.intervals import INDEPENDENCE, INTERVALS, wilson
from analysis.labels import TITLES, task_title
from analysis.outcomes import criterion, radii_cm
from analysis.results import Results
from analysis.scatter import Panel, combinations, described, intervals_shown, scatter_figure
from analysis.selection import Selection, selections
from bns.plotting.style import style

NAME = "success-by-diversity"
PAPER = "figures 4.12 and 5.27"
COLOUR = "mutation_rate"
HARD = 0.5
"""A task whose best combination succeeds less often is drawn at the next goal radius as well (figure 4.12d)."""


def draw(store: Results) -> list[FigureResult]:
    return [_draw(store, chosen) for chosen in selections(store)]


@style()
def _draw(store: Results, chosen: Selection) -> FigureResult:
    rows, thin = combinations(store, chosen)
    shown = success_panels(store, chosen, rows)
    figure, axes = scatter_figure(shown, COLOUR, "successful runs (%)")
    for ax in axes:
        ax.set_ylim(-2, 102)
    what = (
        f"Fraction of runs whose fittest controller {criterion(store, chosen)} at the last evaluation, against the mean "
        f"diversity of their populations then, by {TITLES[COLOUR]}; "
        + intervals_shown(rows, f"95 % Wilson intervals ({INDEPENDENCE})")
    )
    return described(
        store, chosen, figure, rows, name=NAME, title="Success against diversity", what=what, intervals=INTERVALS,
        thin=thin, see=in_words(chosen, rows),
    )  # fmt: skip


def success_panels(store: Results, chosen: Selection, rows: pd.DataFrame) -> list[Panel]:
    """A panel a task, and one more at the next goal radius for tasks that are too hard to show a pattern at the first."""
    near, shown = radii_cm(store, chosen), []
    for task in (task for task in chosen.tasks if task in set(rows.task)):
        own, title = rows[rows.task == task], task_title(chosen.robot, task)
        shown.append(_panel(own, "success", f"{title}, within {near[0]} cm" if near else title))
        if len(near) > 1 and (own.success / own.runs).max() < HARD:
            shown.append(_panel(own, f"success_{near[1]}cm", f"{title}, within {near[1]} cm"))
    return shown


def _panel(rows: pd.DataFrame, column: str, title: str) -> Panel:
    low, high = wilson(rows[column], rows.runs)
    return Panel(title, rows.assign(y=100 * rows[column] / rows.runs, low=100 * low, high=100 * high))


def in_words(chosen: Selection, rows: pd.DataFrame) -> str:
    """What the best combination of each task reaches, and at which diversity."""
    best = rows.assign(share=rows.success / rows.runs).sort_values(["share", "runs"]).drop_duplicates("task", keep="last")
    return " ".join(
        f"{task_title(chosen.robot, row.task)}: the best dot is at {100 * row.share:.0f} %, diversity {row.diversity:.2f}."
        for row in best.itertuples()
    )
