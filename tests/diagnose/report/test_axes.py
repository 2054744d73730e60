"""Axes of the figures: labels that do not overlap, names with units, paths that can be seen."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from bns.diagnose.report.figures import _axis, _minor_labels, errors_axes
from bns.diagnose.report.proposal_figure import _legend_below, _zoom
from bns.plotting.style import PAGE_IN, style


@pytest.mark.parametrize(("low", "high", "labelled"), [(3.0, 80.0, "25"), (3.0, 12.0, "2357"), (3.0, 5.0, "23456789")])
def test_a_long_logarithmic_axis_has_few_labels(low, high, labelled):
    label = _minor_labels(low, high)
    assert [label(float(v)) != "" for v in range(2, 10)] == [str(v) in labelled for v in range(2, 10)]
    assert label(50.0) == "50"


def test_a_direction_becomes_a_name_with_its_unit():
    assert _axis("forward, mm/s") == "forward error (mm/s)"


def test_short_paths_fill_their_panel_and_long_ones_show_the_arena():
    for size, zoomed in ((20.0, True), (200.0, False)):
        axis = Figure().subplots()
        axis.set(xlim=(0, 250), ylim=(0, 250))
        _zoom(axis, size * np.array([[0.0, 0.0], [0.5, 1.0]]), 250.0)
        assert bool(np.ptp(axis.get_xlim()) < 50.0) is zoomed
    _zoom(axis, np.zeros((2, 2)), 250.0)
    assert axis.get_xlim() == (0, 250)


SHORT, LONG = ["motor-lag", "dead-zone", "wheelbase"], ["motor-lag + marker-offset + wheel-mismatch + speed-gain"] * 3


@style()
@pytest.mark.parametrize(("names", "columns"), [(SHORT, 3), (LONG, 1)])
def test_a_legend_of_explanations_stays_within_the_page(names, columns):
    figure = Figure(figsize=(PAGE_IN, 2.6))
    axes = figure.subplots()
    for name in names:
        axes.plot([0, 1], [0, 1], label=name)
    _legend_below(figure, axes)
    figure.canvas.draw()
    shown = figure.legends[0].get_window_extent()
    assert figure.legends[0]._ncols == columns
    assert 0 <= shown.x0 < shown.x1 <= figure.bbox.x1


@style()
@pytest.mark.parametrize("names", [["as given", "+ motor-lag"], ["as given", *(f"+ {name}" for name in (*SHORT, "speed-gain"))]])
def test_names_along_the_axis_do_not_touch(names):
    model = SimpleNamespace(rms_m=0.01, low_m=0.009, high_m=0.011)
    errors = SimpleNamespace(windows=9, models=[model] * len(names), noise_floor_m=0.001, horizon="1s")
    figure = Figure(figsize=(PAGE_IN * 0.75, 3.0))
    axes = figure.subplots()
    errors_axes(axes, SimpleNamespace(horizons={"1s": errors}), names)
    figure.canvas.draw()
    labels = axes.get_xticklabels()
    if labels[0].get_rotation() == 0:
        ends = [label.get_window_extent() for label in labels]
        assert all(one.x1 < other.x0 for one, other in pairwise(ends))
    else:
        assert {label.get_ha() for label in labels} == {"right"}
    assert (labels[0].get_rotation() != 0) is (len(names) > 2)
