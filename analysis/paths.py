"""Figures 4.4 to 4.6 and 5.16 to 5.21: the path of each run's best controller, as driven and as its simulator saw it."""

from __future__ import annotations

import pandas as pd

from analysis.coverage import coverage
from analysis.figure_result import FigureResult
from analysis.labels import CELL, TITLES, counted, task_title, valued
from analysis.repeats import mean_path, paths_of, repeats_of
from analysis.results import NoDataError, Results
from analysis.selection import of_earlier_files, of_newest_files
from bns.plotting.style import draw_paths, frame_alike, goal_reach, note, outcome, panels, style
from bns.robots import load_robot
from bns.tasks import load_task

NAME = "paths"
PAPER = "figures 4.4 to 4.6, 5.16 to 5.21"
OF_A_RUN = True
FIRST = "prototype"
"""The sweep whose runs come first: the dissertation's own trials."""
MOST_PANELS = 6
WORLD, SNN = ["x_m", "y_m", "heading_rad"], ["snn_x_m", "snn_y_m", "snn_heading_rad"]


def last_successes(store: Results) -> pd.DataFrame:
    """The evaluation to show of each run that has paths: its last success, or its last.

    A run that several sweeps have counts once, for the first of them. Of a sweep with several files, those of the newest.
    """
    return store.query(f"""
        WITH with_paths AS (SELECT run_id, coalesce(min(sweep) FILTER (sweep = '{FIRST}'), min(sweep)) AS sweep
                            FROM paths SEMI JOIN (SELECT run_id, sweep FROM runs WHERE {of_newest_files(store)})
                            USING (run_id, sweep) GROUP BY run_id)
        SELECT robot, task, sweep, seed, run_id, {", ".join(CELL)},
               coalesce(max(evaluation) FILTER (success), max(evaluation)) AS evaluation, bool_or(success) AS success,
               coalesce(arg_max(fittest_commands, evaluation) FILTER (success), arg_max(fittest_commands, evaluation)) AS commands
        FROM evals SEMI JOIN with_paths USING (run_id, sweep)
        GROUP BY ALL ORDER BY ALL""").sort_values("sweep", key=lambda sweep: sweep != FIRST, kind="stable")


def poses(store: Results, shown: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Poses of the fittest controller at those evaluations, by run."""
    which = " OR ".join(
        f"(run_id = '{row.run_id}' AND sweep = '{row.sweep}' AND evaluation = {row.evaluation})"
        for row in shown.itertuples()
    )
    rows = store.query(f"""SELECT run_id, step, {", ".join(WORLD + SNN)} FROM paths
        WHERE who = 'fittest' AND ({which}) ORDER BY run_id, step""")
    return dict(iter(rows.groupby("run_id")))


def draw(store: Results) -> list[FigureResult]:
    runs = last_successes(store)
    if runs.empty:
        raise NoDataError(
            f"no finished run has paths; run bns sweep {FIRST}, or one by hand: bns run --record full"
        )
    return [_draw_task(store, robot, task, found) for (robot, task), found in runs.groupby(["robot", "task"])]


@style()
def _draw_task(store: Results, robot: str, task: str, runs: pd.DataFrame) -> FigureResult:
    shown, sweeps = runs.head(MOST_PANELS), tuple(runs.sweep.unique())
    walked, goals_m = poses(store, shown), load_task(robot, task).goals_m
    radius_m, square = goal_reach(load_robot(robot), load_task(robot, task))
    figure, axes = panels(len(shown), 3.5)
    numbers = list(walked.values())
    differ = [name for name in CELL if shown[name].nunique() > 1]
    for run, ax in zip(shown.itertuples(), axes[:, 0], strict=True):
        path = walked[run.run_id]
        repeats = repeats_of(store.results, str(run.sweep), str(run.run_id), int(run.evaluation))
        drives = paths_of(repeats, WORLD)
        world = mean_path(drives) if drives else path[WORLD].to_numpy()
        draw_paths(ax, goals_m, radius_m, world, path[SNN].to_numpy(), square, drives)
        if drives:
            numbers.append(repeats.assign(run_id=run.run_id)[["run_id", "repeat", "step", *WORLD]])
        origin = f"{run.sweep},\n" if len(sweeps) > 1 else ""
        origin += "".join(f"{TITLES[name]} {valued(name, getattr(run, name))},\n" for name in differ)
        driven = len(path) - 1
        cut = f",\nended in cycle {driven} of {int(run.commands)}" if driven < run.commands else ""
        reached = repeats.groupby("repeat").success.first().sum()
        again = f",\nall goals in {reached} of {len(drives)} drives" if drives else ""
        ax.set_title(f"{origin}seed {run.seed}, evaluation {run.evaluation}:\n{outcome(run.success)}{cut}{again}")
    frame_alike(axes[:, 0])
    legends = (ax.get_legend_handles_labels() for ax in axes[:, 0])
    figure.legend(*max(legends, key=lambda legend: len(legend[1])), loc="outside upper center", ncols=3)
    succeeded, n = int(runs.success.sum()), len(runs)
    said = (*coverage(store, sweeps).missing, *of_earlier_files(store, robot, sweeps))
    if n > len(shown):
        said = (*said, f"{counted(n - len(shown), 'more run')} of this task not shown")
    note(figure, "; ".join((f"Task {task_title(robot, task)}: {succeeded} of {n} runs visited all goals", *said)) + ".")
    shows = (
        f"Paths of the fittest controller of each run at its last success, or at its last evaluation if it had "
        f"none ({succeeded} of n = {n} runs of {', '.join(sweeps)} had one), on task {task_title(robot, task)}. Solid: "
        f"driven, until it ended; dashed: the same commands as its networks predict them; dots: ends of commands; grey: "
        f"goals, {100 * radius_m:g} cm from their middle to their edge, in order."
    )
    if len(numbers) > len(walked):
        shows += " Where a trial drove its final controller several times, each drive is thin and their mean is solid."
    title = f"Paths of robot and simulator, {task_title(robot, task)}"
    return FigureResult(f"{NAME}-{robot}-{task}", title, figure, shows, n, sweeps, said, data=pd.concat(numbers))
