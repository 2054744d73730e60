"""Success and fitness error in the world that controllers were transferred to, against evaluations."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.intervals import INTERVALS, bootstrap, wilson
from bns.plotting.style import GREY, OKABE_ITO, PAGE_IN, note, save, style
from bns.tasks import load_task

_LINES = ("-", "--", "-.", ":")
BLOCK = 5
"""Lines are means over so many evaluations: single drives of one controller scatter."""
SHOWN = ("success_10cm", "success_20cm")
"""The radius at which the dissertation's own figures compare, and the widest."""


@style()
def transfer_figure(
    drives: pd.DataFrame, compared: Mapping[str, str], references: Mapping[str, str], stem: Path, robot: str = "khepera"
) -> Path:
    """A row a task: success within 10 cm and within 20 cm, and fitness error; a line a sweep. The path of the PNG.

    ``compared`` and ``references``: sweep -> label; references are thin and grey, without their intervals.
    """
    tasks = list(dict.fromkeys(drives.task))
    figure = Figure(figsize=(PAGE_IN, 2.0 * len(tasks) + 0.9))
    axes = figure.subplots(len(tasks), 3, sharex=True, squeeze=False)
    looks = _looks(compared, references)
    for row, task in zip(axes, tasks, strict=True):
        for sweep, look in looks.items():
            runs = drives[(drives.task == task) & (drives.sweep == sweep)]
            for ax, name in zip(row, (*SHOWN, "fitness_error"), strict=True):
                _curve(ax, runs.pivot(index="seed", columns="evaluation", values=name), look, sweep in compared)
        row[0].set_ylabel(load_task(robot, task).title)
        for ax in row[:2]:
            ax.set_ylim(-0.03, 1.03)
        row[2].set_ylim(bottom=0)
    for ax, title in zip(axes[0], ("success within 10 cm", "success within 20 cm", "fitness error (1/m)"), strict=True):
        ax.set_title(title)
    for ax in axes[-1]:
        ax.set_xlabel("evaluations")
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside upper center", ncols=len(looks))
    note(
        figure,
        f"Fittest controller after each evaluation, driven in the robot's world: means over {_seeds(drives)} seeds and {BLOCK} "
        f"evaluations. Success: {INTERVALS} for so many seeds. Fitness error: 95 % bootstrap over seeds.",
    )
    stem.parent.mkdir(parents=True, exist_ok=True)
    return save(figure, stem)[0]


def _looks(compared: Mapping[str, str], references: Mapping[str, str]) -> dict[str, dict[str, Any]]:
    thick = {
        sweep: {"color": OKABE_ITO[i % len(OKABE_ITO)], "linestyle": _LINES[i % len(_LINES)], "label": label}
        for i, (sweep, label) in enumerate(compared.items())
    }
    thin = {
        sweep: {"color": GREY, "linestyle": _LINES[(i + 2) % len(_LINES)], "linewidth": 0.8, "label": label}
        for i, (sweep, label) in enumerate(references.items())
    }
    return thick | thin


def _seeds(drives: pd.DataFrame) -> str:
    counts = drives.groupby(["sweep", "task"]).seed.nunique()
    return f"{counts.min()}" if counts.min() == counts.max() else f"{counts.min()} to {counts.max()}"


def _curve(ax: Axes, table: pd.DataFrame, look: Mapping[str, Any], banded: bool) -> None:
    """One line of a table (seeds, evaluations), its interval by what it holds: shares or numbers."""
    blocks = table.shape[1] // BLOCK or 1
    parts = np.array_split(table.to_numpy(float), blocks, axis=1)
    values = np.stack([part.mean(axis=1) for part in parts], axis=1)
    middles = np.array([columns.mean() for columns in np.array_split(table.columns.to_numpy(), blocks)])
    ax.plot(middles, values.mean(axis=0), **look)
    if banded:
        is_share = table.to_numpy().dtype.kind == "b"
        low, high = wilson(values.sum(axis=0), len(values)) if is_share else bootstrap(values, np.ones_like(values))
        ax.fill_between(middles, low, high, color=look["color"], alpha=0.15, linewidth=0)
