"""Figures 5.11 to 5.13 and table 5.2: controllers evolved on a static simulator, and what became of them in the physics world."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from analysis.figure_result import FigureResult
from analysis.labels import task_title
from analysis.results import NoDataError, Results
from bns.plotting.style import BLUE, GREY, RED, draw_goals, frame_alike, goal_reach, note, panels, style
from bns.robots import load_robot
from bns.tasks import load_task

NAME = "trajectories"
PAPER = "figures 5.11 to 5.13, table 5.2"
SOURCE = (
    "It shows the best three of twelve (89, 78 and 100 % of the goals; 21, 16 and 53 cm); of the others three left the "
    "surface, three rolled over between cycles, one had an unstable cycle, two transferred poorly."
)
_MARGIN_M = 0.1


def draw(store: Results) -> list[FigureResult]:
    tables = sorted((store.results / "validation").glob("*.parquet"))
    if not tables:
        raise NoDataError("no controllers were validated; run bns validate --robot snake")
    return [_draw(path) for path in tables]


def by_trial(table: pd.DataFrame, goals: int) -> pd.DataFrame:
    """Table 5.2 for all trials: cycles, generations, share of goals reached, mean error at the end, what became of each drive."""
    drives = table[table.repeat > 0].drop_duplicates(["trial", "repeat"])
    rows = drives.groupby("trial").agg(
        commands=("commands", "first"),
        generations=("generations", "first"),
        goals=("goals_reached", lambda reached: f"{reached.mean() / goals:.0%}"),
        error_cm=("final_error_m", lambda error: round(100 * error.mean())),
        outcome=("outcome", lambda outcome: "; ".join(f"{n} {what}" for what, n in outcome.value_counts().items())),
    )
    names = {"error_cm": "error at the end, cm", "goals": "goals reached", "outcome": "three drives"}
    return rows.reset_index().rename(columns=names)


@style()
def _draw(path: Path) -> FigureResult:
    robot, task = path.stem.split("-", 1)
    table, aim = pd.read_parquet(path), load_task(robot, task)
    reach, square = goal_reach(load_robot(robot), aim)
    trials = list(table.groupby("trial"))
    figure, axes = panels(len(trials), 1.75, columns=4)
    for (number, rows), ax in zip(trials, axes[:, 0], strict=True):
        draw_goals(ax, aim.goals_m, reach, square)
        _paths(ax, rows)
        ax.set_title(f"trial {number}: {rows[rows.repeat > 0].outcome.mode().iloc[0]}")
        half = 100 * (np.array(aim.surface_m) / 2 + _MARGIN_M)
        ax.set(xlim=(-half[0], half[0]), ylim=(-half[1], half[1]), aspect="equal")
    frame_alike(axes[:, 0])
    for at in (8, 9, 10, 11):
        axes[min(at, len(axes) - 1), 0].set_xlabel("x, east (cm)")
    for at in range(0, len(axes), 4):
        axes[at, 0].set_ylabel("y, north (cm)")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    listed = by_trial(table, len(aim.goals_m))
    drives = table[table.repeat > 0].drop_duplicates(["trial", "repeat"])
    counts = "; ".join(f"{what}: {n}" for what, n in drives.outcome.value_counts().items())
    of = f"{len(drives)} drives of {len(trials)} controllers"
    note(figure, f"Path of the midpoint between the markers. Of {of}, {counts}. {SOURCE}")
    shows = (
        f"{len(trials)} controllers evolved on the static simulator alone, with noise, for {task_title(robot, task)}; "
        "dashed: its prediction without noise, solid: three drives of each in the physics world. All trials are shown."
    )
    title = f"Trajectory trials, {task_title(robot, task)}"
    return FigureResult(f"{NAME}-{robot}-{task}", title, figure, shows, len(trials), (), see=SOURCE, data=table, table=listed)


def _paths(ax: Axes, rows: pd.DataFrame) -> None:
    for repeat, path in rows.groupby("repeat"):
        simulated = repeat < 0
        label = "simulator" if simulated else "robot" if repeat == 1 else None
        look = {"color": RED, "linestyle": "--"} if simulated else {"color": BLUE, "linewidth": 1.0}
        ax.plot(100 * path.x_m, 100 * path.y_m, marker=".", markersize=3, label=label, **look)
    start = rows[rows.step == 0].iloc[0]
    ax.plot(100 * start.yellow_x_m, 100 * start.yellow_y_m, "s", color=GREY, markersize=4, label="yellow marker at the start")
    ax.plot(100 * start.green_x_m, 100 * start.green_y_m, ">", color=GREY, markersize=4, label="green")
