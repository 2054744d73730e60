"""What generations and training iterations after each evaluation buy, and what they cost."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

from analysis.coverage import coverage
from analysis.drawn import Drawn
from analysis.intervals import INDEPENDENCE, INTERVALS, wilson
from analysis.store import NoDataError, Store
from analysis.words import each, task_order, task_title
from bns.plotting import note, ordered_styles, panels, style

NAME = "budget"
PAPER = "choice of defaults, not in the source"
TITLE = "How much evolution and training an evaluation gets"
SWEEP = "budget"
RUNS = 1000
"""The core-hours are those of this many runs."""


def cells(store: Store) -> pd.DataFrame:
    """Of each task, generations and iterations: runs, successes at the last evaluation, CPU seconds a run."""
    return store.query(f"""
        WITH last AS (SELECT evals.run_id, success_7cm, cpu_s FROM evals JOIN runs USING (run_id, sweep)
                      WHERE sweep = '{SWEEP}' AND status = 'ok' AND evaluation = evaluations)
        SELECT robot, task, generations_per_evaluation AS generations,
               training_iterations_per_evaluation AS iterations, count(*) AS runs,
               count(*) FILTER (last.success_7cm) AS successes, median(last.cpu_s) AS cpu_s,
               quantile_cont(last.cpu_s, 0.1) AS cpu_low_s, quantile_cont(last.cpu_s, 0.9) AS cpu_high_s
        FROM runs JOIN last USING (run_id) WHERE sweep = '{SWEEP}' AND last.success_7cm IS NOT NULL
        GROUP BY ALL ORDER BY ALL""")


@style()
def draw(store: Store) -> list[Drawn]:
    rows = cells(store)
    if rows.empty:
        raise NoDataError(f"no finished run of the sweep {SWEEP!r}; run make sweep-budget")
    tasks = sorted(set(zip(rows.robot, rows.task, strict=True)), key=lambda pair: task_order(*pair))
    looks = dict(zip(sorted(rows.iterations.unique()), ordered_styles(rows.iterations.nunique()), strict=True))
    columns = sorted(rows.generations.unique())
    figure, axes = panels(len(tasks), 5.0, rows_each=2, ratios=(1, 1))
    for (robot, task), (above, below) in zip(tasks, axes, strict=True):
        here = rows[rows.task == task]
        _success(above, here, looks, columns)
        _cost(below, here, looks, columns)
        above.set_title(task_title(robot, task))
    _share_costs(axes[:, 1])
    axes[0, 0].set_ylabel("successful runs, 7 cm (%)")
    handles, labels = max((ax.get_legend_handles_labels() for ax in axes[:, 0]), key=lambda pair: len(pair[1]))
    figure.legend(handles, labels, loc="outside upper center", ncols=4, title="training iterations an evaluation")
    n, runs_each = int(rows.runs.sum()), each(rows.runs.min(), rows.runs.max())
    said = coverage(store, (SWEEP,), n)
    note(
        figure,
        "; ".join((*said.sentences, f"{runs_each} a point")) + f". Bars above: {INTERVALS}; below: "
        "median, 10 to 90 % of the runs.",
    )
    shows = (
        f"Above: share of runs whose fittest controller visits all goals within 7 cm at the last evaluation "
        f"(95 % Wilson intervals: {INDEPENDENCE}). Below: CPU time of a run (median, 10 to 90 %). By generations and training "
        f"iterations after each evaluation; {runs_each} a point, n = {n:,} runs of {SWEEP}."
    )
    return [Drawn(NAME, TITLE, figure, shows, n, (SWEEP,), said.missing, data=rows)]


def _lines(ax: Axes, rows: pd.DataFrame, looks: dict, columns: list[int], value: str, low: str, high: str) -> None:
    for number, (iterations, line) in enumerate(rows.groupby("iterations")):
        # Side by side, so that the intervals of one column can be told apart.
        x = [columns.index(g) + 0.12 * (number - (len(looks) - 1) / 2) for g in line.generations]
        ax.vlines(x, line[low], line[high], color=looks[iterations]["color"], linewidth=1.2)
        ax.plot(x, line[value], label=f"{iterations:,}", **looks[iterations])
    ax.set_xticks(range(len(columns)), [f"{g:,}" for g in columns])
    ax.set_xlim(-0.5, len(columns) - 0.5)
    ax.set_xlabel("generations an evaluation")


def _success(ax: Axes, rows: pd.DataFrame, looks: dict, columns: list[int]) -> None:
    low, high = wilson(rows.successes, rows.runs)
    shares = rows.assign(share=100 * rows.successes / rows.runs, low=100 * low, high=100 * high)
    _lines(ax, shares, looks, columns, "share", "low", "high")
    ax.set_ylim(-2, 102)


def _cost(ax: Axes, rows: pd.DataFrame, looks: dict, columns: list[int]) -> None:
    ax.set_yscale("log")
    _lines(ax, rows, looks, columns, "cpu_s", "cpu_low_s", "cpu_high_s")


def _share_costs(axes: Sequence[Axes]) -> None:
    """One scale for all tasks: seconds on the left, core-hours of many runs on the right."""
    ends = [ax.get_ylim() for ax in axes]
    for ax in axes:
        ax.set_ylim(min(low for low, _ in ends), max(high for _, high in ends))
        _plain(ax.yaxis)
    axes[0].set_ylabel("CPU time a run (s)")
    hours = axes[-1].secondary_yaxis("right", functions=(lambda s: s * RUNS / 3600, lambda h: h * 3600 / RUNS))
    _plain(hours.yaxis)
    hours.set_ylabel(f"core-hours for {RUNS:,} runs")


def _plain(axis: Axis) -> None:
    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_locator(NullLocator())
