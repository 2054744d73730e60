"""Axes of the figures: labels that do not overlap, names with units, paths that can be seen."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from bns.diagnose.report.figures import _axis, _minor_labels
from bns.diagnose.report.proposal_figure import _zoom


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
