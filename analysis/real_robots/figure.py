"""Error on held-out trials before and after, one row a robot and floor, one panel a horizon."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from bns.plotting import GREY, OKABE_ITO, save, style

_HORIZONS = {"1s": "1 s ahead", "trial": "whole trial ahead"}


@style()
def error_figure(answers: Mapping[str, Mapping[str, Any]], titles: Mapping[str, str], path: Path) -> Path:
    """Position errors of the model as drawn, with its effective wheelbase, with what was found, and the noise floor."""
    names = [name for name, answer in answers.items() if answer["error"]][::-1]
    figure = Figure(figsize=(6.5, 0.3 * len(names) + 1.3))
    axes = figure.subplots(1, len(_HORIZONS), sharey=True)
    for ax, (horizon, words) in zip(axes, _HORIZONS.items(), strict=True):
        for row, name in enumerate(names):
            error = answers[name]["error"][horizon]
            ax.plot([error["after"], answers[name]["drawn"][horizon]], [row, row], color=GREY, linewidth=0.7, zorder=1)
            points = {
                "as drawn": (answers[name]["drawn"][horizon], "x", OKABE_ITO[1]),
                "model diagnosed": (error["before"], "o", OKABE_ITO[4]),
                "with what was found": (error["after"], "D", OKABE_ITO[0]),
                "noise floor": (error["noise_floor"], "|", "black"),
            }
            for label, (value, marker, colour) in points.items():
                ax.plot(value, row, marker, color=colour, label=label if row == 0 else None)
        ax.set_xscale("log")
        ax.xaxis.set_major_formatter("{x:g}")
        ax.set_xlabel(f"position error {words} (m)")
        ax.grid(axis="x", alpha=0.3)
    axes[0].set_yticks(range(len(names)), [titles[name] for name in names])
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return save(figure, path)[0]
