"""What was just driven, as a picture: to look at before it is kept or driven again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from bns.hardware.safety import Surface
from bns.plotting.style import OKABE_ITO


def draw_drive(path_m: Sequence[tuple[float, float]], goals_m: np.ndarray, surface: Surface, file: Path) -> None:
    """The path (n, 2) on the surface, with the goals (g, 2); PNG. Nobody meets half a file."""
    figure = Figure(figsize=(4.0, 4.0), layout="constrained")
    ax = figure.subplots()
    x_m, y_m = np.array(path_m).T
    size_m = surface.x_high_m - surface.x_low_m, surface.y_high_m - surface.y_low_m
    ax.add_patch(Rectangle((surface.x_low_m, surface.y_low_m), *size_m, fill=False, color="0.7"))
    ax.plot(x_m, y_m, color=OKABE_ITO[0])
    ax.plot(x_m[0], y_m[0], "o", color=OKABE_ITO[0], label="start")
    ax.plot(*np.asarray(goals_m).reshape(-1, 2).T, "x", color=OKABE_ITO[1], label="goals")
    ax.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    ax.legend()
    unfinished = file.with_name(f".{file.name}.part")
    figure.savefig(unfinished, format="png", dpi=120)
    unfinished.replace(file)
