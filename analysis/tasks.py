"""The three Khepera tasks with their goals: ``python -m analysis.tasks docs/figures`` draws the picture in the docs."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from bns.plotting.style import draw_goals, frame_alike, panels, save, style
from bns.robots import load_robot
from bns.tasks import load_task, task_names


@style()
def draw(out: Path) -> Path:
    robot = load_robot("khepera")
    names = sorted(task_names(robot.name), key=lambda name: load_task(robot.name, name).source)
    figure, axes = panels(len(names), 2.9)
    start = robot.start_pose()[0]
    for name, ax in zip(names, axes[:, 0], strict=True):
        task = load_task(robot.name, name)
        draw_goals(ax, task.goals_m, robot.radii_m[0])
        course = 100 * np.vstack([start[:2], task.goals_m])
        ax.plot(course[:, 0], course[:, 1], ":", color="#555555", linewidth=1, label="order of the goals")
        ax.plot(0, 0, marker="^", color="black", markersize=8, linestyle="none", label="start, facing north")
        ax.set_title(f"{task.source.split(' (')[0]}: {task.title}")
        ax.set(xlabel="x, east (cm)", ylabel="y, north (cm)", aspect="equal", xlim=(-64, 64), ylim=(-64, 64))
    frame_alike(axes[:, 0])
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return save(figure, out / "tasks")[0]


if __name__ == "__main__":
    print(draw(Path(sys.argv[1])))
