"""Why networks are wrong, as a picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bns.diagnose.data.tracks import Array
from bns.diagnose.report.network_text import VARIABLES
from bns.diagnose.residuals.network_errors import NetworkErrors
from bns.diagnose.settings import DEFAULTS
from bns.plotting.style import GREY, OKABE_ITO, PAGE_IN, note, save, style

_BINS = DEFAULTS.report.network_bins


@style()
def network_errors_figure(why: NetworkErrors, path: Path) -> Path:
    """Error against distance to the training patterns; the error along what the inputs cannot know; the shares."""
    figure = Figure(figsize=(PAGE_IN, 2.9))
    near, along, shares = figure.subplots(1, 3, width_ratios=(1.1, 1.0, 0.9))
    _draw_distance(near, why)
    _draw_along(along, why)
    _draw_shares(shares, why)
    note(
        figure,
        "Errors of whole commands in units of the networks' outputs (0.2 m to the right, 0.3 m ahead, 3 rad). Dots joined: means "
        "of equally many commands; bars: two standard errors.",
    )
    return save(figure, path)[0]


def _draw_distance(ax: Axes, why: NetworkErrors) -> None:
    outside = why.distance > why.radius
    for chosen, colour, label in ((~outside, OKABE_ITO[0], "among them"), (outside, OKABE_ITO[1], "outside")):
        ax.plot(why.distance[chosen], why.size[chosen], ".", color=colour, markersize=3, alpha=0.5, label=label)
    ax.axvline(why.radius, color=GREY, linestyle="--")
    ax.set_yscale("log")
    ax.set_xlabel("distance to the training patterns")
    ax.set_ylabel("error of a command")
    ax.set_title("(a) are the data thin?")
    ax.legend(loc="lower right", frameon=True, framealpha=0.9, markerscale=3, handlelength=1)


def _draw_along(ax: Axes, why: NetworkErrors) -> None:
    ax.set_title("(b) can the inputs know?")
    names = [one.variable for one in (why.missing_inputs or why.alone) if one.variable in why.commands.variables]
    if not names:
        ax.text(
            0.5, 0.5, "only the place explains any" if why.share else "not asked", ha="center", transform=ax.transAxes
        )
        return
    chosen = why.distance <= why.radius
    values = why.commands.variables[names[0]][chosen]
    if names[0] == "heading_rad":
        values = (values + np.pi) % (2 * np.pi) - np.pi
    for channel, marker, way in zip(range(3), "os^", ("to the right", "ahead", "turn"), strict=True):
        _binned(ax, values, why.commands.error[chosen, channel], OKABE_ITO[channel], marker, way)
    ax.axhline(0.0, color=GREY, linewidth=0.8)
    ax.set_xlabel(VARIABLES.get(names[0], names[0]).replace(" (", "\n(").replace("kept from", "kept\nfrom"))
    ax.set_ylabel("measured − predicted")
    low, high = ax.get_ylim()
    ax.set_ylim(low - 0.55 * (high - low), high)  # room for the legend
    ax.legend(loc="lower left", handlelength=1)


def _binned(ax: Axes, values: Array, errors: Array, colour: str, marker: str, label: str) -> None:
    bins = [b for b in np.array_split(np.argsort(values), _BINS) if len(b) > 1]
    middle, mean = (np.array([of[b].mean() for b in bins]) for of in (values, errors))
    bars = np.array([2 * errors[b].std(ddof=1) / np.sqrt(len(b)) for b in bins])
    ax.errorbar(middle, mean, bars, color=colour, marker=marker, label=label, capsize=2)


def _draw_shares(ax: Axes, why: NetworkErrors) -> None:
    ax.set_title("(c) fraction of squared error")
    names = list(why.share)[::-1]
    ax.barh(range(len(names)), [why.share[n] for n in names], color=[GREY, *OKABE_ITO[2::-1]][: len(names)])
    for row, name in enumerate(names):
        ax.text(why.share[name] + 0.02, row, f"{why.share[name]:.0%}", va="center")
    ax.set_yticks(range(len(names)), names)
    ax.set_xlim(0, 1.15)
    ax.xaxis.set_major_formatter(lambda value, _: f"{value:.0%}" if value <= 1 else "")
    ax.grid(visible=False, axis="y")
