"""Success against evaluations, a curve a value of one parameter: what figures 4.7 to 4.10 and 5.22 to 5.25 share."""

from __future__ import annotations

import math

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from analysis.coverage import coverage
from analysis.figure_result import FigureResult
from analysis.intervals import POOLED, pooled
from analysis.labels import TITLES, counted, task_title, valued
from analysis.outcomes import FEWEST, by_value, criterion
from analysis.results import Results
from analysis.selection import Selection, selections
from bns.plotting.style import lettered, note, ordered_styles, panels, style

WHOSE = {
    "success": ("Success", "whose fittest controller, driven in the world after each evaluation, {what}"),
    "ever_success": ("Success so far", "in which a fittest controller, driven after this or an earlier evaluation, {what}"),
}
"""Column of evals -> what the figure is called, and of which runs it shows the fraction."""


def success_by(store: Results, parameter: str, name: str, success: str = "success") -> list[FigureResult]:
    """One figure a robot; NoDataError where no sweep compares values of ``parameter``. ``success``: a column of `WHOSE`."""
    return [_draw(store, chosen, parameter, name, success) for chosen in selections(store, parameter)]


@style()
def _draw(store: Results, chosen: Selection, parameter: str, name: str, success: str) -> FigureResult:
    rows, thin, least = enough_runs(pooled(by_value(store, chosen, parameter, success), ("task", "value")))
    tasks, n = [task for task in chosen.tasks if task in set(rows.task)], chosen.n - thin
    looks = dict(zip(sorted(rows.value.unique()), ordered_styles(rows.value.nunique()), strict=True))
    figure, axes = panels(len(tasks), 3.6, rows_each=2, ratios=(3, 1))
    for number, (task, (ax, below)) in enumerate(zip(tasks, axes, strict=True)):
        _panel(ax, rows[rows.task == task], looks, parameter)
        ax.set_title(lettered(number, len(axes), task_title(chosen.robot, task)))
        below.set_axis_off()
        below.legend(*ax.get_legend_handles_labels(), loc="upper center", title=TITLES[parameter])
    axes[0, 0].set_ylabel("successful runs (%)")
    said, what = coverage(store, chosen.sweeps, n), criterion(store, chosen)
    too_few = (f"{counted(thin, 'run')} in curves of fewer than {least} not drawn",) if thin else ()
    note(figure, "; ".join((f"Success: {what}", *said.sentences, *too_few, POOLED)) + ".")
    title, whose = WHOSE[success]
    shows = (
        f"Fraction of runs {whose.format(what=what)}, by {TITLES[parameter]}; "
        f"all other parameters pooled. n = {n:,} runs of {chosen.source}; {POOLED}."
    )
    return FigureResult(
        f"{name}-{chosen.robot}",
        f"{title} by {TITLES[parameter]}",
        figure,
        shows,
        n,
        chosen.sweeps,
        (*said.missing, *too_few, *chosen.left_out),
        see=" ".join(filter(None, (_largest_gap(rows[rows.task == task], chosen, parameter) for task in tasks))),
        data=rows.rename(columns={"value": parameter}),
    )


def enough_runs(rows: pd.DataFrame) -> tuple[pd.DataFrame, int, int]:
    """The curves to draw, how many runs stand in the others, and the least that a curve must have.

    Beside a curve of many runs one of a tenth as many is left out: it jumps, and its band covers the panel.
    """
    runs = rows.groupby(["task", "value"]).runs.transform("max")
    least = max(FEWEST, math.ceil(runs.max() / 10)) if (runs >= FEWEST).any() else 1
    left_out = rows[runs < least].groupby(["task", "value"]).runs.max().sum()
    return rows[runs >= least], int(left_out), least


def _panel(ax: Axes, rows: pd.DataFrame, looks: dict[float, dict[str, str]], parameter: str) -> None:
    for value, curve in rows.groupby("value"):
        every = max(1, len(curve) // 6)
        ax.fill_between(
            curve.evaluation, 100 * curve.low, 100 * curve.high, color=looks[value]["color"], alpha=0.18, linewidth=0
        )
        ax.plot(
            curve.evaluation,
            100 * curve.successes / curve.runs,
            **looks[value],
            markevery=(every // 2, every),
            label=f"{valued(parameter, value)} (n = {curve.runs.max():,})",
        )
    ax.set(ylim=(-2, 102), xlabel="evaluation in the world", xlim=(0, rows.evaluation.max() + 1))
    ax.xaxis.set_major_locator(MaxNLocator(6, integer=True, steps=[1, 2, 5, 10]))


def _largest_gap(rows: pd.DataFrame, chosen: Selection, parameter: str) -> str:
    """Where the curves of one task lie furthest apart, in words; "" for a single curve."""
    shares = (rows.successes / rows.runs).groupby([rows.evaluation, rows.value]).first().unstack()
    if shares.shape[1] < 2:
        return ""
    gaps = shares.max(axis=1) - shares.min(axis=1)
    if not gaps.max() > 0:
        return f"{task_title(chosen.robot, rows.task.iloc[0])}: no difference at any evaluation."
    at = shares.loc[gaps.idxmax()]
    return (
        f"{task_title(chosen.robot, rows.task.iloc[0])}: widest at evaluation {gaps.idxmax()}, "
        f"{100 * gaps.max():.0f} points between {valued(parameter, at.idxmax())} and {valued(parameter, at.idxmin())}."
    )
