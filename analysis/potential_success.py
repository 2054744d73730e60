"""Figure 4.16: the potential success indicator, success within the widest goal radius, of the ten best combinations."""

from __future__ import annotations

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
from bns.plotting.style import GREY, note, ordered_styles, panels, style

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


@style()
def _draw(store: Results, chosen: Selection) -> FigureResult:
    rows = ranking(store, chosen)
    tops = {task: extremes(rows, task)[0] for task in chosen.tasks if (rows.task == task).sum() > 1}
    if not tops:
        raise NoDataError("no task has two combinations with enough runs; run bns sweep khepera-small")
    lines = {task: curve(store, chosen, task, cells) for task, cells in tops.items()}
    figure, axes = panels(1, 3.4)
    _panel(axes[0, 0], chosen, lines)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    n, said = int(sum(cells.runs.sum() for cells in tops.values())), coverage(store, chosen.sweeps, chosen.n)
    note(figure, "; ".join((f"{n:,} runs in the best combinations", *said.missing, f"bands: {BOOTSTRAP}")) + ".")
    shows = (
        f"Fraction of runs whose fittest controller visits all goals within {RADIUS_CM} cm, of the best "
        f"{max(map(len, tops.values()))} combinations of each task; bands are {BOOTSTRAP}. n = {n:,} runs of "
        f"{', '.join(chosen.sweeps)}. The best are picked by success at the last evaluation, so their success is overestimated."
    )
    see = " ".join(_half(task_title(chosen.robot, task), line) for task, line in lines.items())
    return FigureResult(
        f"{NAME}-{chosen.robot}", "Potential success of the best combinations", figure, shows, n, chosen.sweeps,
        (*said.missing, *chosen.left_out), see=see, data=pd.concat(lines.values()),
    )  # fmt: skip


def _panel(ax: Axes, chosen: Selection, lines: dict[str, pd.DataFrame]) -> None:
    for look, (task, line) in zip(ordered_styles(len(lines)), lines.items(), strict=True):
        every = max(1, len(line) // 6)
        ax.fill_between(line.evaluation, 100 * line.low, 100 * line.high, color=look["color"], alpha=0.18, linewidth=0)
        label = task_title(chosen.robot, task)
        ax.plot(line.evaluation, 100 * line.share, **look, markevery=(every // 2, every), label=label)
    ax.axhline(50, color=GREY, linewidth=0.8)
    longest = max(line.evaluation.max() for line in lines.values())
    ax.set(ylim=(-2, 102), xlim=(0, longest + 1), xlabel="evaluation in the world")
    ax.set_ylabel(f"runs within {RADIUS_CM} cm (%)")
    ax.xaxis.set_major_locator(MaxNLocator(6, integer=True, steps=[1, 2, 5, 10]))


def _half(title: str, line: pd.DataFrame) -> str:
    reached = line.evaluation[np.asarray(line.share >= 0.5)]
    return f"{title}: half of the runs by evaluation {reached.iloc[0]}." if len(reached) else f"{title}: never half of the runs."
