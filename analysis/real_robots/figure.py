"""Error on held-out trials before and after, one row a robot and floor, one panel a horizon."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from bns.diagnose.predict.horizons import HORIZONS
from bns.plotting.style import OKABE_ITO, PAGE_IN, note, save, style

_WORDS = {"command": "to the end of a command", "1s": "1 s ahead", "5s": "5 s ahead", "trial": "a whole trial ahead"}
_SHOWN = {
    "before": ("model diagnosed", "o", OKABE_ITO[4], 0.15),
    "after": ("with what was found", "D", OKABE_ITO[0], -0.15),
}
_NOTE = (
    "Lines: 95 % bootstrap intervals over trials, before and after on the same windows. Noise: of the tracking alone, where the "
    "poses show it. Windows of the Warthog last 2 s. Driven by encoders, every row of a log is a command."
)


@style()
def error_figure(answers: Mapping[str, Mapping[str, Any]], titles: Mapping[str, str], path: Path) -> Path:
    """Position errors of the model that was diagnosed and of the one with what was found, with intervals, and the noise floor."""
    names = [name for name, answer in answers.items() if answer["error"]][::-1]
    figure = Figure(figsize=(PAGE_IN, 0.5 * len(names) + 1.9))
    panels = figure.subplots(2, 2, sharex=True, sharey=True).ravel()
    for ax, horizon in zip(panels, HORIZONS, strict=True):
        for row, name in enumerate(names):
            _draw(ax, row, answers[name], horizon)
        ax.set_xscale("log")
        ax.xaxis.set_major_formatter("{x:g}")
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set_title(_WORDS[horizon])
        ax.set_ylim(-0.6, len(names) - 0.4)
        ax.grid(axis="y", visible=False)
        ax.set_yticks(range(len(names)), [titles[name] for name in names])
    for ax in panels[2:]:
        ax.set_xlabel("position error (m)")
    marks = {text: mark for ax in panels for mark, text in zip(*ax.get_legend_handles_labels(), strict=True)}
    figure.legend(marks.values(), marks.keys(), loc="outside upper center", ncols=3)
    note(figure, _NOTE)
    return save(figure, path)[0]


def _draw(ax: Axes, row: int, answer: Mapping[str, Any], horizon: str) -> None:
    error = answer["error"][horizon]
    if error["before"] is None:
        return
    for key, (label, marker, colour, lift) in _SHOWN.items():
        ends = answer["intervals"][horizon][key]
        ax.plot(ends, [row + lift] * 2, color=colour, linewidth=1)
        ax.plot(error[key], row + lift, marker, color=colour, label=label, linestyle="none")
    if error["noise_floor"] is not None:
        ax.plot(error["noise_floor"], row, "|", color="black", markersize=9, label="tracking noise", linestyle="none")
