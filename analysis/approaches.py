"""Approaches compared: success against evaluations and against robot minutes, and minutes until success lasts."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from analysis.figure_result import FigureResult
from analysis.intervals import INTERVALS, wilson
from analysis.labels import counted, task_title
from analysis.results import NoDataError, Results
from analysis.robot_time import LASTING, minutes_until_lasting, success_by_minute, survival
from bns.plotting.style import OKABE_ITO, lettered, note, panels, style

NAME = "approaches"
PAPER = "section 2.6, its approaches compared with BNS"
SWEEPS = "approaches"
"""Names of the sweeps that compare approaches begin so."""
MINUTES = 60
_LINES = ("-", "--")


def draw(store: Results) -> list[FigureResult]:
    runs = store.query(
        f"""SELECT sweep, run_id, robot, task, world, approach, evaluation, robot_s, success, evaluated_fitness_error
        FROM evals SEMI JOIN (SELECT run_id, sweep FROM runs WHERE status = 'ok') AS done USING (run_id, sweep)
        WHERE starts_with(sweep, '{SWEEPS}') ORDER BY sweep, robot, task, world, approach, run_id, evaluation"""
    )
    if runs.approach.nunique() < 2:
        raise NoDataError("no sweep has runs of two approaches; run bns sweep approaches-small")
    return [_draw(own) for _, own in runs.groupby(["sweep", "robot", "task", "world"])]


@style()
def _draw(evals: pd.DataFrame) -> FigureResult:
    first = evals.iloc[0]
    approaches = list(dict.fromkeys(evals.approach))
    looks = {name: {"color": OKABE_ITO[i % 7], "linestyle": _LINES[i // 7 % 2]} for i, name in enumerate(approaches)}
    figure, axes = panels(3, 3.4)
    tables = []
    for approach, own in evals.groupby("approach", sort=False):
        by_evaluation, by_minute, until = _numbers(own)
        _curve(axes[0, 0], by_evaluation.evaluation, by_evaluation, looks[approach], approach)
        _curve(axes[1, 0], by_minute.minute, by_minute, looks[approach], approach)
        times, share = survival(until.minutes, until.ended)
        axes[2, 0].step([*times, until.minutes.max()], [*(100 * share), 100 * share[-1]], where="post", **looks[approach])
        tables.append(_row(approach, own, by_evaluation, until))
    axes[0, 0].set(xlabel="evaluation in the world", ylabel="successful runs (%)")
    axes[1, 0].set(xlabel="robot time (min)")
    axes[2, 0].set(xlabel="robot time (min)", ylabel="runs without lasting success (%)")
    for number, title in enumerate(("by evaluation", "by robot time", "until success lasts")):
        axes[number, 0].set_title(lettered(number, 3, title))
        axes[number, 0].set(ylim=(-2, 102))
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    n, least = evals.run_id.nunique(), int(evals.groupby("approach").run_id.nunique().min())
    where = f"{task_title(first.robot, first.task)}, world {first.world}"
    note(figure, f"{where}; {counted(n, 'run')}, {least} at least of each approach; bands: {INTERVALS}.")
    shows = (
        f"Task {where}, {first.sweep}. (a, b) Fraction of runs whose fittest controller completes the task after so many "
        f"evaluations, and robot minutes (all drives counted, with the spec's overhead). (c) Fraction of runs in which {LASTING} "
        f"successes in a row have not begun yet (Kaplan-Meier). n = {n} runs, {least} at least of each approach; {INTERVALS}."
    )
    table = pd.DataFrame(tables)
    name = f"{NAME}-{first.sweep}-{first.robot}-{first.task}-{str(first.world).split('/')[-1].removesuffix('.yaml')}"
    return FigureResult(
        name, f"Approaches compared: {where}", figure, shows, n, (str(first.sweep),), data=table, table=table
    )


def _numbers(own: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Success by evaluation and by minute, and minutes until it lasts, of one approach."""
    counts = own.groupby("evaluation").success.agg(runs="count", successes="sum").reset_index()
    low, high = wilson(counts.successes, counts.runs)
    last = own.groupby("run_id").robot_s.max().min() / 60
    return (
        counts.assign(low=low, high=high),
        success_by_minute(own, np.linspace(0, last, MINUTES)),
        minutes_until_lasting(own),
    )


def _curve(ax: Axes, x: pd.Series, rows: pd.DataFrame, look: dict[str, str], label: str) -> None:
    ax.fill_between(x, 100 * rows.low, 100 * rows.high, color=look["color"], alpha=0.08, linewidth=0)
    ax.plot(x, 100 * rows.successes / rows.runs, label=label, **look)


def _row(approach: str, own: pd.DataFrame, by_evaluation: pd.DataFrame, until: pd.DataFrame) -> dict[str, object]:
    """What the table says of an approach."""
    last = by_evaluation.iloc[-1]
    return {
        "approach": approach,
        "runs": int(last.runs),
        "success at the end (%)": round(100 * last.successes / last.runs),
        "low (%)": round(100 * last.low),
        "high (%)": round(100 * last.high),
        "lasting success (runs)": int(until.ended.sum()),
        "median minutes until it": round(float(until.minutes[until.ended].median()), 1) if until.ended.any() else None,
        "robot minutes of a run": round(float(own.groupby("run_id").robot_s.max().median() / 60), 1),
        "error of fitness of the driven, median (1/m)": round(float(own.evaluated_fitness_error.median()), 3),
    }
