"""Success of the fittest controller now beside success so far: two readings of "successful runs" that lie far apart."""

from __future__ import annotations

import pandas as pd

from analysis.coverage import coverage
from analysis.figure_result import FigureResult
from analysis.intervals import POOLED, pooled
from analysis.labels import task_title
from analysis.outcomes import criterion
from analysis.results import Results
from analysis.selection import Selection, selections
from bns.plotting.style import BLUE, RED, lettered, note, panels, style

NAME = "success-so-far"
PAPER = "figures 4.7 and 5.22, another reading"
READINGS = {"success": "the fittest controller, now", "ever_success": "a controller, so far"}
"""Columns of evals: what the other figures show, and whether the run has "developed a controller that completes the task"."""


def draw(store: Results) -> list[FigureResult]:
    return [_draw(store, chosen) for chosen in selections(store)]


def counted(store: Results, chosen: Selection) -> pd.DataFrame:
    """Runs and successes of each task, evaluation and reading, all combinations together, with the intervals of `POOLED`."""
    sums = ", ".join(f"count(*) FILTER ({name}) AS {name}" for name in READINGS)
    rows = store.query(f"""SELECT task, evaluation, root_seed, seed, count(success) AS runs, {sums}
        FROM evals JOIN ({chosen.sql}) AS chosen USING (run_id, sweep) WHERE success IS NOT NULL GROUP BY ALL ORDER BY ALL""")
    keys = ["task", "evaluation", "root_seed", "seed", "runs"]
    return pooled(rows.melt(keys, list(READINGS), "reading", "successes"), ("task", "reading"))


@style()
def _draw(store: Results, chosen: Selection) -> FigureResult:
    rows = counted(store, chosen)
    figure, axes = panels(len(chosen.tasks), 3.2)
    looks = dict(zip(READINGS, ({"color": BLUE}, {"color": RED, "linestyle": "--"}), strict=True))
    for number, (task, ax) in enumerate(zip(chosen.tasks, axes[:, 0], strict=True)):
        for reading, curve in rows[rows.task == task].groupby("reading"):
            look = looks[reading]
            ax.fill_between(curve.evaluation, 100 * curve.low, 100 * curve.high, color=look["color"], alpha=0.2, linewidth=0)
            ax.plot(curve.evaluation, 100 * curve.successes / curve.runs, label=READINGS[reading], **look)
        ax.set_title(lettered(number, len(axes), task_title(chosen.robot, task)))
        ax.set(ylim=(-2, 102), xlabel="evaluation in the world")
    axes[0, 0].set_ylabel("successful runs (%)")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    said, what = coverage(store, chosen.sweeps, chosen.n), criterion(store, chosen)
    note(figure, "; ".join((f"Success: {what}", *said.sentences, POOLED)) + ".")
    shows = (
        f"Fraction of runs in which the fittest controller, driven after this evaluation, {what}, and of those in which it has "
        f"done so after this or an earlier one; all combinations together, n = {chosen.n:,} runs of {chosen.source}; "
        f"{POOLED}."
    )
    return FigureResult(
        f"{NAME}-{chosen.robot}", "Success now and so far", figure, shows, chosen.n, chosen.sweeps,
        (*said.missing, *chosen.left_out), see=_in_words(rows, chosen), data=rows,
    )  # fmt: skip


def _in_words(rows: pd.DataFrame, chosen: Selection) -> str:
    last = rows[rows.evaluation == rows.groupby("task").evaluation.transform("max")].set_index(["task", "reading"])
    share = 100 * last.successes / last.runs
    return " ".join(
        f"{task_title(chosen.robot, task)}, at the last evaluation: {share[task, 'success']:.0f} % now and "
        f"{share[task, 'ever_success']:.0f} % so far."
        for task in chosen.tasks
    )
