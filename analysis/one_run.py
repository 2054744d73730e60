"""Figure 4.17: one run over time. Fitness of each generation, and how far simulators are from the world and each other."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from analysis.figure_result import FigureResult
from analysis.labels import counted, task_number, task_title
from analysis.results import NoDataError, Results
from analysis.selection import of_newest_files
from bns.plotting.style import BLUE, GREY, RED, lettered, note, panels, style

NAME = "one-run"
PAPER = "figure 4.17"
OF_A_RUN = True
FIRST = "prototype"
"""The sweep whose runs come first: the dissertation's own settings."""
TASK = 2
"""The dissertation shows a run of its second task."""
TITLES = ("fitness", "simulator and world", "successive simulators")
SHOWN = 30
"""Evaluations that the dissertation's run had."""


def draw(store: Results) -> list[FigureResult]:
    runs = store.query(f"""SELECT DISTINCT robot, task, sweep, seed, run_id, evaluations,
        generations_per_evaluation AS generations
        FROM runs SEMI JOIN probes USING (run_id, sweep) SEMI JOIN generations USING (run_id, sweep)
        WHERE status = 'ok' AND generations_per_evaluation > 0 AND {of_newest_files(store)}""")
    if runs.empty:
        raise NoDataError(
            f"no finished run has generations and probes; run bns sweep {FIRST}, or: bns run --record full"
        )
    numbers = [task_number(row.robot, row.task) for row in runs.itertuples()]
    runs = runs.assign(other_sweep=runs.sweep != FIRST, other_task=[number != TASK for number in numbers])
    runs = runs.sort_values(["robot", "other_task", "other_sweep", "sweep", "task", "seed", "run_id"])
    return [_draw(store, run) for run in runs.drop_duplicates("robot").itertuples()]


@style()
def _draw(store: Results, run) -> FigureResult:
    shown = min(SHOWN, run.evaluations)
    where = f"run_id = '{run.run_id}' AND sweep = '{run.sweep}' AND evaluation <= {shown}"
    generations = store.query(f"SELECT * FROM generations WHERE {where} ORDER BY generation")
    probes = store.query(f"SELECT evaluation, probe, distance_m, change_m FROM probes WHERE {where} ORDER BY ALL")
    figure, axes = panels(3, 3.0)
    _fitness(axes[0, 0], generations, run.generations)
    _distances(axes[1, 0], probes)
    totals = _changes(axes[2, 0], probes)
    for number, (ax, title) in enumerate(zip(axes[:, 0], TITLES, strict=True)):
        ax.set_title(lettered(number, 3, title))
        ax.set(xlabel="evaluation in the world", xlim=(0, shown + 0.5))
    many = probes.probe.nunique()
    of = f"evaluations 1 to {shown} of {run.evaluations}"
    note(figure, f"One run of {run.sweep}: task {task_title(run.robot, run.task)}, seed {run.seed}, {of}; no interval: n = 1.")
    shows = (
        f"One run ({run.run_id} of {run.sweep}, task {task_title(run.robot, run.task)}, seed {run.seed}, {of}). (a) Largest "
        f"fitness of each generation in simulation, and of the same controller driven in the world. (b) Distance between the "
        f"ends of {counted(many, 'random controller')} of five commands in simulation and in the world; thick: the median. "
        f"(c) How far those ends moved from one simulator to the next, summed over the {many}."
    )
    return FigureResult(
        f"{NAME}-{run.robot}", "One run over time", figure, shows, 1, (run.sweep,),
        see=_in_words(probes, totals), data=probes,
    )  # fmt: skip


def _fitness(ax: Axes, rows: pd.DataFrame, per_evaluation: int) -> None:
    # A generation's place between evaluations: the first after an evaluation stands just behind it.
    x = rows.evaluation + (rows.generation - rows.groupby("evaluation").generation.transform("min")) / per_evaluation
    ax.plot(x, rows.best_fitness_world, ".", markersize=2.5, color=BLUE, label="in the world")
    ax.plot(x, rows.best_fitness, color=RED, linewidth=1.2, label="in simulation")
    ax.set(ylabel="fitness (1/m)")
    both = np.concatenate([rows.best_fitness, rows.best_fitness_world])
    positive = both[np.isfinite(both) & (both > 0)]
    if len(positive):
        ax.set_yscale("log")
        ax.set_ylim(0.8 * positive.min(), 5 * positive.max())
    ax.legend(loc="upper left", handlelength=1.5)


def _distances(ax: Axes, probes: pd.DataFrame) -> None:
    for number, (_, one) in enumerate(probes.groupby("probe")):
        label = "_" if number else "each random controller"
        ax.plot(one.evaluation, 100 * one.distance_m, color=GREY, linewidth=0.6, alpha=0.7, label=label)
    ax.plot(100 * probes.groupby("evaluation").distance_m.median(), color=BLUE, linewidth=2, label="median")
    ax.set(ylabel="distance (cm)")
    _log(ax, probes.distance_m)
    ax.set_ylim(top=6 * ax.get_ylim()[1] if ax.get_yscale() == "log" else None)  # room for the legend
    ax.legend(loc="upper left", handlelength=1.5)


def _changes(ax: Axes, probes: pd.DataFrame) -> pd.Series:
    totals = probes.groupby("evaluation").change_m.sum(min_count=1).dropna()
    ax.plot(100 * totals, "o", color=BLUE, markersize=3)
    ax.set(ylabel="summed change (cm)")
    _log(ax, totals)
    return totals


def _log(ax: Axes, values: pd.Series) -> None:
    if (values.dropna() > 0).any():
        ax.set_yscale("log")


def _in_words(probes: pd.DataFrame, totals: pd.Series) -> str:
    medians = 100 * probes.groupby("evaluation").distance_m.median()
    moved = f"; successive simulators differ by {100 * totals.iloc[-1]:.0f} cm in all, {100 * totals.iloc[0]:.0f} cm at first"
    return (
        f"Median distance of simulator and world: {medians.iloc[0]:.0f} cm after the first evaluation, {medians.iloc[-1]:.1f} cm "
        f"after evaluation {medians.index[-1]}{moved if len(totals) else ''}."
    )
