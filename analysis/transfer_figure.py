"""Success and fitness error in the world that controllers were transferred to, against evaluations."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.intervals import INTERVALS, bootstrap, wilson
from bns.plotting import OKABE_ITO, PAGE_IN, note, save, style
from bns.tasks import load_task

_LINES = ("-", "--", "-.", ":")
SMOOTHED = 5
"""Fitness error is averaged over so many evaluations: single drives of one controller scatter."""


@style()
def transfer_figure(drives: pd.DataFrame, labels: Mapping[str, str], stem: Path, robot: str = "khepera") -> Path:
    """A row a task: success within 7 cm and within 20 cm, and fitness error; a line a sweep. The path of the PNG."""
    tasks = list(dict.fromkeys(drives.task))
    figure = Figure(figsize=(PAGE_IN, 2.1 * len(tasks) + 0.9))
    axes = figure.subplots(len(tasks), 3, sharex=True, squeeze=False)
    for row, task in zip(axes, tasks, strict=True):
        for number, (sweep, label) in enumerate(labels.items()):
            runs = drives[(drives.task == task) & (drives.sweep == sweep)]
            look = {"color": OKABE_ITO[number], "linestyle": _LINES[number % len(_LINES)], "label": label}
            for ax, name in zip(row, ("success_7cm", "success_20cm"), strict=False):
                _share(ax, runs.pivot(index="seed", columns="evaluation", values=name), look)
            _error(row[2], runs.pivot(index="seed", columns="evaluation", values="fitness_error"), look)
        row[0].set_ylabel(load_task(robot, task).title)
        for ax in row[:2]:
            ax.set_ylim(-0.03, 1.03)
        row[2].set_ylim(bottom=0)
    for ax, title in zip(axes[0], ("success within 7 cm", "success within 20 cm", "fitness error (1/m)"), strict=True):
        ax.set_title(title)
    for ax in axes[-1]:
        ax.set_xlabel("evaluations")
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside upper center", ncols=len(labels))
    counts = drives.groupby(["sweep", "task"]).seed.nunique()
    seeds = f"{counts.min()}" if counts.min() == counts.max() else f"{counts.min()} to {counts.max()}"
    note(
        figure,
        f"Fittest controller after each evaluation, driven in the robot's world; {seeds} seeds a line. Success: {INTERVALS}. "
        f"Fitness error: mean over seeds and {SMOOTHED} evaluations, 95 % bootstrap over seeds.",
    )
    stem.parent.mkdir(parents=True, exist_ok=True)
    return save(figure, stem)[0]


def _share(ax: Axes, table: pd.DataFrame, look: dict[str, str]) -> None:
    succeeded = table.to_numpy(float)
    low, high = wilson(succeeded.sum(axis=0), len(succeeded))
    _line(ax, table.columns.to_numpy(), succeeded.mean(axis=0), low, high, look)


def _error(ax: Axes, table: pd.DataFrame, look: dict[str, str]) -> None:
    blocks = table.shape[1] // SMOOTHED or 1
    parts = np.array_split(table.to_numpy(float), blocks, axis=1)
    errors = np.stack([part.mean(axis=1) for part in parts], axis=1)
    middles = [columns.mean() for columns in np.array_split(table.columns.to_numpy(), blocks)]
    low, high = bootstrap(errors, np.ones_like(errors))
    _line(ax, np.array(middles), errors.mean(axis=0), low, high, look)


def _line(ax: Axes, x: np.ndarray, y: np.ndarray, low: np.ndarray, high: np.ndarray, look: dict[str, str]) -> None:
    ax.plot(x, y, **look)
    ax.fill_between(x, low, high, color=look["color"], alpha=0.15, linewidth=0)
