"""What generations and training iterations after each evaluation buy, and what they cost."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

from analysis.coverage import coverage
from analysis.figure_result import FigureResult
from analysis.intervals import mean_interval
from analysis.labels import each, task_order, task_title
from analysis.results import FROM_RUNS, NoDataError, Results
from bns.plotting.style import note, ordered_styles, panels, style

NAME = "budget"
PAPER = "choice of defaults, not in the dissertation"
TITLE = "How much evolution and training an evaluation gets"
SWEEP = "budget"
LATE = 0.3
"""Share of a run's evaluations that count: one alone depends on its luck more than on what is compared."""
MEANS = "Student's 95 % intervals of the mean"
RUNS = 1000
"""The core-hours are those of this many runs."""


NEAR_CM = (10, 7)
"""Within these radii success is shown, a row each."""


def cells(store: Results) -> pd.DataFrame:
    """Of each task, generations and iterations: runs, CPU seconds a run, and within each radius the share of late evaluations
    with success: its mean over runs, and the ends of Student's 95 % interval of that mean, in percent."""
    shares = ", ".join(f"100 * avg(success_{cm}cm::INT) AS share_{cm}" for cm in NEAR_CM)
    means = ", ".join(f"avg(share_{cm}) AS share_{cm}, stddev_samp(share_{cm}) AS spread_{cm}" for cm in NEAR_CM)
    rows = store.query(f"""
        WITH late AS (SELECT run_id, sweep, any_value(cpu_s) AS cpu_s, {shares} FROM evals JOIN runs USING (run_id, sweep)
                      WHERE sweep = '{SWEEP}' AND status = 'ok' AND success_7cm IS NOT NULL
                            AND evaluation > {1 - LATE} * evaluations GROUP BY ALL)
        SELECT robot, task, generations_per_evaluation AS generations,
               training_iterations_per_evaluation AS iterations, count(*) AS runs, {means}, median(late.cpu_s) AS cpu_s,
               quantile_cont(late.cpu_s, 0.1) AS cpu_low_s, quantile_cont(late.cpu_s, 0.9) AS cpu_high_s
        FROM runs JOIN late USING (run_id, sweep) GROUP BY ALL ORDER BY ALL""")
    for cm in NEAR_CM:
        low, high = mean_interval(rows[f"share_{cm}"], rows[f"spread_{cm}"], rows.runs)
        rows[f"low_{cm}"], rows[f"high_{cm}"] = low.clip(0, 100), high.clip(0, 100)
    return rows


@style()
def draw(store: Results) -> list[FigureResult]:
    rows = cells(store)
    if rows.empty:
        raise NoDataError(f"no finished run of the sweep {SWEEP!r}; run bns sweep budget")
    if store.archived and rows.cpu_s.isna().all():
        raise NoDataError(f"an archive does not hold what this is drawn from (cpu_s); {FROM_RUNS}")
    tasks = sorted(set(zip(rows.robot, rows.task, strict=True)), key=lambda pair: task_order(*pair))
    looks = dict(zip(sorted(rows.iterations.unique()), ordered_styles(rows.iterations.nunique()), strict=True))
    columns = sorted(rows.generations.unique())
    figure, axes = panels(len(tasks), 6.4, rows_each=len(NEAR_CM) + 1)
    for (robot, task), (*above, below) in zip(tasks, axes, strict=True):
        here = rows[rows.task == task]
        for cm, ax in zip(NEAR_CM, above, strict=True):
            _lines(ax, here, looks, columns, f"share_{cm}", f"low_{cm}", f"high_{cm}")
            ax.set_ylim(-2, 102)
        below.set_yscale("log")
        _lines(below, here, looks, columns, "cpu_s", "cpu_low_s", "cpu_high_s")
        below.set_xlabel("generations per evaluation")
        above[0].set_title(task_title(robot, task))
    _share_costs(axes[:, -1])
    for cm, ax in zip(NEAR_CM, axes[0], strict=False):
        ax.set_ylabel(f"success within\n{cm} cm (%)")
    handles, labels = max((ax.get_legend_handles_labels() for ax in axes[:, 0]), key=lambda pair: len(pair[1]))
    figure.legend(handles, labels, loc="outside upper center", ncols=4, title="training iterations per evaluation")
    n, runs_each = int(rows.runs.sum()), each(rows.runs.min(), rows.runs.max())
    said = coverage(store, (SWEEP,), n)
    note(
        figure,
        "; ".join((*said.sentences, f"{runs_each} per point")) + ". Success: fraction of the last "
        f"{LATE:.0%} of the evaluations; bars: {MEANS}, of the CPU time 10 to 90 % of the runs.",
    )
    shows = (
        f"Above: fraction of the last {LATE:.0%} of a run's evaluations after which its fittest controller visits all goals "
        f"within {' and '.join(map(str, NEAR_CM))} cm, mean over runs ({MEANS}). Below: CPU time of a run (median, 10 to 90 %). "
        f"By generations and training iterations after each evaluation; {runs_each} per point, n = {n:,} runs of {SWEEP}."
    )
    return [FigureResult(NAME, TITLE, figure, shows, n, (SWEEP,), said.missing, data=rows)]


def _lines(ax: Axes, rows: pd.DataFrame, looks: dict, columns: list[int], value: str, low: str, high: str) -> None:
    for number, (iterations, line) in enumerate(rows.groupby("iterations")):
        # Side by side, so that the intervals of one column can be told apart.
        x = [columns.index(g) + 0.12 * (number - (len(looks) - 1) / 2) for g in line.generations]
        ax.vlines(x, line[low], line[high], color=looks[iterations]["color"], linewidth=1.2)
        ax.plot(x, line[value], label=f"{iterations:,}", **looks[iterations])
    ax.set_xticks(range(len(columns)), [f"{g:,}" for g in columns])
    ax.set_xlim(-0.5, len(columns) - 0.5)


def _share_costs(axes: Sequence[Axes]) -> None:
    """One scale for all tasks: seconds on the left, core-hours of many runs on the right."""
    ends = [ax.get_ylim() for ax in axes]
    for ax in axes:
        ax.set_ylim(min(low for low, _ in ends), max(high for _, high in ends))
        _plain(ax.yaxis)
    axes[0].set_ylabel("CPU time per run (s)")
    hours = axes[-1].secondary_yaxis("right", functions=(lambda s: s * RUNS / 3600, lambda h: h * 3600 / RUNS))
    _plain(hours.yaxis)
    hours.set_ylabel(f"core-hours for {RUNS:,} runs")


def _plain(axis: Axis) -> None:
    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_locator(NullLocator())
