"""Tables 4.2 (Khepera) and 5.4 (snake): evaluations until success of the prototype trials, and the minutes they would cost."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from analysis.coverage import coverage
from analysis.figure_result import FigureResult
from analysis.labels import counted, task_number, task_order, task_title
from analysis.results import NoDataError, Results
from analysis.source import trials_of
from bns.plotting.style import BLUE, GREY, RED, note, panels, style

NAME = "trials"
PAPER = "tables 4.2 and 5.4"
OF_A_RUN = True
SWEEPS = "prototype"
"""Sweeps with this name, or this ending (robot-prototype), are the dissertation's trials: its settings, a few seeds."""
IN_A_ROW = 3
"""The dissertation's trials went on until the robot was seen to do the task consistently: here, this often in succession."""
MARKS = {
    "first_success": ("first success", "success", 1),
    "consistent": (f"consistent, {IN_A_ROW} in succession", "success", IN_A_ROW),
    "consistent_10cm": ("consistent, within 10 cm", "success_10cm", IN_A_ROW),
}
"""What a trial is measured by: what it is called, the column of successes, how many of them in succession."""


def draw(store: Results) -> list[FigureResult]:
    rows = trials(store)
    if rows.empty:
        raise NoDataError(f"no finished prototype trial; run bns sweep {SWEEPS}")
    return [_draw(store, str(robot), own) for robot, own in rows.groupby("robot")]


def trials(store: Results) -> pd.DataFrame:
    """Of each prototype trial, or of the one run asked for, the evaluation of each of MARKS, and driving minutes until the first.

    Marks that never came are empty. Of trials with the same seed (of an older engine, say) the newest counts.
    """
    which = "true" if store.run else f"regexp_matches(sweep, '(^|-){SWEEPS}$')"
    rows = store.query(f"""
        SELECT robot, task, sweep, seed, run_id, evaluation, success, success_10cm, driven_ms
        FROM evals SEMI JOIN (SELECT run_id, sweep FROM runs WHERE status = 'ok' AND {which}
            QUALIFY row_number() OVER (PARTITION BY robot, task, seed ORDER BY started_at DESC, sweep) = 1) USING (run_id, sweep)
        ORDER BY robot, task, seed, run_id, evaluation""")
    return pd.DataFrame([_trial(one) for _, one in rows.groupby("run_id", sort=False)])


def _trial(rows: pd.DataFrame) -> dict[str, object]:
    head, driven = rows.iloc[0], np.cumsum(rows.driven_ms.to_numpy()) / 60_000
    marks = marks_of(rows)
    first = marks["first_success"]
    return {
        **{name: head[name] for name in ("robot", "task", "sweep", "seed", "run_id")},
        "evaluations": len(rows),
        **{name: math.nan if mark is None else mark for name, mark in marks.items()},
        "driving_min": math.nan if first is None else float(driven[first - 1]),
    }


def marks_of(rows: pd.DataFrame) -> dict[str, int | None]:
    """The evaluation of each of `MARKS` in one run's evals, in order; None where it never came."""
    return {name: first_in_a_row(rows[column].fillna(False).to_numpy(bool), many) for name, (_, column, many) in MARKS.items()}


def first_in_a_row(success: np.ndarray, many: int) -> int | None:
    """Number (from 1) of the evaluation that completes the first ``many`` successes in succession; None if there is none."""
    run = np.convolve(success.astype(int), np.ones(many, int), "valid") == many if len(success) >= many else np.array([])
    return int(np.argmax(run)) + many if run.any() else None


@style()
def _draw(store: Results, robot: str, rows: pd.DataFrame) -> FigureResult:
    sweeps = tuple(sorted(rows.sweep.unique()))
    tasks = sorted(rows.task.unique(), key=lambda task: task_order(robot, task))
    figure, axes = panels(1, 1.9 + 0.7 * len(tasks))
    _dots(axes[0, 0], robot, rows, tasks)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=1)
    said, never = coverage(store, sweeps, len(rows) if store.run else None), int(rows.consistent.isna().sum())
    not_yet = (f"{never} never {IN_A_ROW} in succession",) if never else ()
    note(figure, "; ".join((*said.sentences, *not_yet, "one mark a trial")) + ".")
    shows = (
        f"Evaluations until success of each trial of {', '.join(sweeps)}, and of the dissertation's trials on robots. First: the "
        f"fittest controller visits all goals. Consistent: in {IN_A_ROW} evaluations in a row (the dissertation judged by eye). "
        f"Minutes: {_pace(robot)}. Driving: the commands of the controllers that were driven until the first success."
    )
    return FigureResult(
        f"{NAME}-{robot}", "Trials until success", figure, shows, len(rows), sweeps, said.missing,
        see=_in_words(robot, rows, tasks), data=rows, table=_table(robot, rows, tasks),
    )  # fmt: skip


def _dots(ax: Axes, robot: str, rows: pd.DataFrame, tasks: list[str]) -> None:
    known = [name for name in MARKS if rows[name].notna().any()]
    looks = dict(zip(MARKS, ({"marker": "o", "mfc": "white"}, {"marker": "o"}, {"marker": "D"}), strict=True))
    for place, task in enumerate(tasks):
        lines = [(rows[rows.task == task][name], MARKS[name][0], {"color": BLUE, **looks[name]}) for name in known]
        theirs = [evaluations for evaluations, _ in trials_of(robot, task_number(robot, task))]
        by_eye = "the dissertation's robot, consistent by eye"
        lines.append((pd.Series(theirs, dtype=float), by_eye, {"color": RED, "marker": "s"}))
        for offset, (values, label, look) in zip(np.linspace(-0.3, 0.3, len(lines)), lines, strict=True):
            ax.plot(values, np.full(len(values), place + offset), ls="none", label=None if place else label, **look)
        if place:
            ax.axhline(place - 0.5, color=GREY, linewidth=0.4)
    ax.set_yticks(range(len(tasks)), [task_title(robot, task) for task in tasks])
    ax.set(ylim=(len(tasks) - 0.5, -0.5), xlabel="evaluations in the world")
    ax.set_xlim(left=0)
    ax.grid(visible=False, axis="y")


def seconds_an_evaluation(robot: str) -> tuple[float, float] | None:
    """Shortest and longest of the dissertation's trials of that robot, s an evaluation; None for a robot it does not have."""
    paces = [60 * minutes / evaluations for number in range(1, 9) for evaluations, minutes in trials_of(robot, number)]
    return (min(paces), max(paces)) if paces else None


def _pace(robot: str) -> str:
    pace = seconds_an_evaluation(robot)
    if pace is None:
        return "unknown, the dissertation has no such robot"
    return f"at the dissertation's {pace[0]:.0f} to {pace[1]:.0f} s an evaluation"


def _table(robot: str, rows: pd.DataFrame, tasks: list[str]) -> pd.DataFrame:
    pace, made = seconds_an_evaluation(robot), []
    for task in tasks:
        theirs = trials_of(robot, task_number(robot, task))
        for trial, row in enumerate(rows[rows.task == task].to_dict("records")):
            ours = {label: _cost(row[name], row["evaluations"], pace) for name, (label, _, _) in MARKS.items()}
            driving = "–" if math.isnan(row["driving_min"]) else f"{row['driving_min']:.1f} min"
            source = f"{theirs[trial][0]:.0f} ({theirs[trial][1]:.0f} min)" if trial < len(theirs) else "–"
            title = task_title(robot, task)
            made.append({"task": title, "seed": row["seed"], **ours, "driving": driving, "the dissertation's trial": source})
    return pd.DataFrame(made)


def _cost(evaluation: float, of: int, pace: tuple[float, float] | None) -> str:
    if math.isnan(evaluation):
        return f"not in {of}"
    minutes = f" ({evaluation * pace[0] / 60:.0f} to {evaluation * pace[1] / 60:.0f} min)" if pace else ""
    return f"{evaluation:.0f}{minutes}"


def _in_words(robot: str, rows: pd.DataFrame, tasks: list[str]) -> str:
    said = []
    for task in tasks:
        first, many = rows[rows.task == task].first_success.dropna(), counted(int((rows.task == task).sum()), "trial")
        when = f"after {first.min():.0f} to {first.max():.0f} evaluations" if len(first) else "never"
        said.append(f"{task_title(robot, task)}: first success {when} ({many})")
    return "; ".join(said) + "."
