"""Pictures of a comparison, a diagnosis and an extended model."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from bns.diagnose.adding import ExtendedModel
from bns.diagnose.comparison import Comparison, Curve
from bns.diagnose.data.variables import label as in_words
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.predict.paired_errors import PairedErrors
from bns.diagnose.report.text import ahead
from bns.diagnose.settings import DEFAULTS
from bns.plotting.style import GREY, NARROW_IN, OKABE_ITO, PAGE_IN, save, style

_TICK_CHARACTERS = DEFAULTS.report.tick_characters
_NARROW_CHARACTERS = 38
"""Of a line of a title above a figure for a phone."""


@style()
def comparison_figure(c: Comparison, path: Path, *, narrow: bool = False) -> Path:
    """Residuals along the variables that explain most, one row a variable, with 95 % bands; ``narrow``: one panel a row."""
    variables = list(dict.fromkeys(curve.variable for curve in c.curves))[:5]
    ways = list(dict.fromkeys(curve.direction for curve in c.curves))
    rows, columns = max(len(variables), 1), max(len(ways), 1)
    figure = Figure(figsize=(NARROW_IN, 1.5 * rows * columns + 0.8) if narrow else (PAGE_IN, 1.8 * rows + 0.5))
    grid = figure.subplots(rows * columns, 1) if narrow else figure.subplots(rows, columns)
    axes = np.reshape(grid, (rows, columns))
    for curve in c.curves:
        if curve.variable in variables:
            _draw_curve(axes[variables.index(curve.variable)][ways.index(curve.direction)], curve)
    for column, way in enumerate(ways):
        for one in axes[:, column] if narrow else axes[:1, column]:
            one.set_title(_axis(way))
    trials = f"{c.trials} trials; bands: 95 %, bootstrap over trials"
    title = f"Measured − predicted by {c.model}, {ahead(c.near)} ahead ({trials})"
    figure.suptitle(textwrap.fill(title, _NARROW_CHARACTERS) if narrow else title)
    return save(figure, path)[0]


def _axis(direction: str) -> str:
    """Name and unit of an error in one direction: "forward error (mm/s)" of "forward, mm/s"."""
    name, _, unit = direction.partition(", ")
    return f"{name} error ({unit})" if unit else name


def curves_of(c: Comparison, variable: str | None = None, direction: str | None = None) -> list[Curve]:
    """The curves along a variable and direction; None: any. Those along what explains most come first."""
    return [
        curve
        for curve in c.curves
        if variable in {None, curve.variable} and (direction is None or curve.direction.startswith(direction))
    ]


def curve_axes(axes: Axes, curve: Curve, c: Comparison) -> None:
    """One curve of a comparison on axes of its own."""
    _draw_curve(axes, curve)
    axes.set_ylabel(_axis(curve.direction))
    axes.set_title(f"Measured − predicted by {c.model}, {ahead(c.near)} ahead")


def _draw_curve(axes: Axes, curve: Curve) -> None:
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.fill_between(curve.centre, curve.low, curve.high, alpha=0.3, color=OKABE_ITO[0], linewidth=0)
    axes.plot(curve.centre, curve.mean, color=OKABE_ITO[0], marker="o")
    axes.set_xlabel(textwrap.fill(in_words(curve.variable), 30))


@style()
def diagnosis_figure(d: Diagnosis, path: Path, most: int = 12, errors: bool = True, *, narrow: bool = False) -> Path:
    """The error before and after (with ``errors``, where effects are named), and the gain of each effect that is added alone.

    ``narrow``: for a phone; without ``errors``.
    """
    assert d.selection is not None
    rows = min(sum(bool(np.isfinite(c.paired_comparison.elpd_diff)) for c in d.selection.steps[0].ranking), most)
    falls = d.errors if d.effects and errors else None
    if narrow:
        figure = Figure(figsize=(NARROW_IN, 0.24 * rows + 1.6))
        axes = figure.subplots()
        ranking_axes(axes, d, most)
        figure.suptitle(axes.get_title())  # longer than the axes are wide
        axes.set(title="", xlabel="gain on held-out trials\n(log-likelihood per trial)")
        _key_below(figure, axes)
        return save(figure, path)[0]
    figure = Figure(figsize=(PAGE_IN * (1.25 if falls else 0.75), max(0.24 * rows + 1.2, 2.8)))
    if falls:
        left, right = figure.subplots(1, 2, width_ratios=(2, 3))
        errors_axes(left, falls, ("as given", "+ " + "\n+ ".join(d.effects)))
        left.set_title("The error falls (bars: 95 %)")
        ranking_axes(right, d, most)
    else:
        ranking_axes(figure.subplots(), d, most)
    return save(figure, path)[0]


def ranking_axes(axes: Axes, d: Diagnosis, most: int = 12) -> None:
    """The same on axes that are there."""
    assert d.selection is not None
    step = d.selection.steps[0]
    shown = [c for c in step.ranking if np.isfinite(c.paired_comparison.elpd_diff)][:most][::-1]
    selected = {*d.effects}
    for row, c in enumerate(shown):
        colour = OKABE_ITO[2] if c.name in selected else GREY if c.rejected_because else OKABE_ITO[0]
        label = _ACCEPTED if c.name in selected else _REJECTED if c.rejected_because else _OTHERS
        gain, se = c.paired_comparison.elpd_diff, c.paired_comparison.dse
        axes.errorbar(gain, row, xerr=1.96 * se, fmt="o", color=colour, capsize=2, label=label)
    axes.axvline(step.decoy_threshold, color=OKABE_ITO[1], linestyle="--", label="best decoy")
    axes.axvline(0.0, color=GREY, linewidth=0.8)
    axes.set_yticks(range(len(shown)), [c.name for c in shown])
    axes.set_xscale("symlog", linthresh=1.0)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set_xlabel("gain on held-out trials (log-likelihood per trial)")
    axes.set_title("Each effect added alone (bars: 95 %)")
    handles = dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
    axes.legend(handles.values(), handles, loc="upper left", handlelength=1, framealpha=0.9)


_ACCEPTED, _OTHERS, _REJECTED = "accepted", "not accepted", "not considered"


@style()
def error_by_step_figure(m: ExtendedModel, path: Path, *, narrow: bool = False) -> Path:
    """Errors on the same held-out windows, as given and with each effect added in turn; one line a horizon, noise dotted."""
    figure = Figure(figsize=(NARROW_IN, 3.6) if narrow else (PAGE_IN * 0.75, 3.0))
    axes = figure.subplots()
    error_by_step_axes(axes, m)
    if narrow:
        axes.set_ylabel("position error (mm, RMS)")
        _key_below(figure, axes)
    return save(figure, path)[0]


def _key_below(figure: Figure, axes: Axes) -> None:
    """The legend of axes below them, where the width is all theirs."""
    inside = axes.get_legend()
    assert inside is not None
    title = inside.get_title().get_text()
    inside.remove()
    handles = dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
    figure.legend(handles.values(), handles, title=title or None, loc="outside lower center", ncols=2, handlelength=1.5)


def error_by_step_axes(axes: Axes, m: ExtendedModel) -> None:
    """The same on axes that are there."""
    errors_axes(axes, m.errors, [name if index == 0 else f"+ {name}" for index, name in enumerate(m.names)])
    axes.set_title("Error, effect by effect (bars: 95 %)")


def errors_axes(axes: Axes, errors: PairedErrors, names: Sequence[str]) -> None:
    """Root mean square error of models judged on the same windows: one line a horizon, the tracking noise dotted."""
    horizons = [e for e in errors.horizons.values() if e.windows]
    beside = 0.05 * (np.arange(len(horizons)) - (len(horizons) - 1) / 2)  # so that their bars can be told apart
    for x, colour, marker, e in zip(beside, OKABE_ITO, "os^D", horizons, strict=False):
        values = [1e3 * one.rms_m for one in e.models]
        ends = np.array([[1e3 * (one.rms_m - one.low_m), 1e3 * (one.high_m - one.rms_m)] for one in e.models]).T
        axes.errorbar(
            np.arange(len(values)) + x,
            values,
            yerr=np.nan_to_num(ends).clip(min=0),
            marker=marker,
            color=colour,
            label=ahead(e.horizon),
            capsize=2,
        )
        if np.isfinite(e.noise_floor_m):
            axes.plot([0, len(values) - 1], [1e3 * e.noise_floor_m] * 2, color=colour, linestyle=":", linewidth=1)
    crowded = sum(map(len, names)) > _TICK_CHARACTERS
    axes.set_xticks(range(len(names)), names, rotation=25 if crowded else 0, ha="right" if crowded else "center")
    axes.set_xlim(-0.3, len(names) - 0.7)
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter(_minor_labels(*axes.get_ylim()))
    axes.set_ylabel("position error on held-out trials (mm, RMS)")
    axes.legend(title="horizon (dotted: tracking noise)", loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _minor_labels(low: float, high: float) -> FuncFormatter:
    """Labels between the powers of ten of a logarithmic axis: as many digits as fit without overlap."""
    decades = np.log10(high / low)
    digits = "25" if decades > 1.0 else "2357" if decades > 0.5 else "23456789"
    return FuncFormatter(lambda value, _: f"{value:g}" if f"{value:e}"[0] in digits else "")
