"""What a comparison lists and draws, by hand: the worst moments, and mean errors along a variable."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.comparison import BINS, _binned, _curves, _edges, _worst
from bns.diagnose.predict.horizons import Errors


def errors(trial, start, end, forward_m, left_m=0.0, heading_rad=0.0):
    """Errors of windows; a number stands for as many."""
    columns = (np.broadcast_to(np.asarray(one, float), len(trial)) for one in (forward_m, left_m, heading_rad))
    return Errors(*(np.array(one) for one in (trial, start, end)), *columns)


def test_the_worst_window_of_each_of_the_worst_trials_is_listed_the_worst_first():
    tracks = SimpleNamespace(names=("a", "b", "c"), own_s=np.arange(6) / 2)
    found = errors([0, 0, 1, 1, 2], [0, 1, 2, 3, 4], [1, 2, 3, 4, 5], [0.01, -0.03, 0.05, 0.04, 0.02], heading_rad=0.1)
    worst = _worst(SimpleNamespace(tracks=tracks), found, most=2)
    assert [(m.trial, m.t_s, m.position_m, m.heading_rad) for m in worst] == [("b", 1.0, 0.05, 0.1), ("a", 0.5, 0.03, 0.1)]


def test_curves_are_errors_a_second_each_in_its_own_direction_and_unit():
    windows = np.arange(40)
    tracks = SimpleNamespace(t_s=2.0 * np.arange(41))
    found = errors(windows % 5, windows, windows + 1, 0.01, -0.02, 0.1)
    at = {"speed": windows / 40.0, "same": np.ones(40)}
    predictor = SimpleNamespace(tracks=tracks, at_frames=lambda _: at)
    dependence = [SimpleNamespace(variable=name) for name in ("speed", "same", "place", "speed")]
    curves = _curves(predictor, found, dependence, np.random.default_rng(0))
    assert [one.variable for one in curves] == ["speed"] * 3
    expected = {"forward, mm/s": 5.0, "left, mm/s": -10.0, "heading, deg/s": np.degrees(0.05)}
    assert {one.direction: one.mean.mean() for one in curves} == pytest.approx(expected)


def test_bins_are_of_as_many_values_and_a_crowd_of_nearly_equal_ones_has_one_bin():
    assert _edges(np.linspace(0.0, 1.0, 1001)) == pytest.approx(np.linspace(0.0, 1.0, BINS + 1))
    crowd = np.concatenate([np.linspace(0.0, 1e-9, 600), np.linspace(1.0, 2.0, 400)])
    edges = _edges(crowd)
    assert edges[1] < 1e-6
    assert edges[2] > 0.9
    assert _edges(np.ones(9)).tolist() == [1.0]


def test_the_band_of_a_mean_holds_95_percent_of_what_other_trials_would_give():
    rate = np.random.default_rng(1).normal(3.0, 1.0, 400)
    one = _binned("x", "forward, mm/s", np.ones(400), rate, np.arange(400), np.random.default_rng(2))
    assert one.centre.tolist() == [1.0]
    assert one.mean[0] == pytest.approx(rate.mean())
    assert (one.high[0] - one.low[0]) / 2 == pytest.approx(1.96 * rate.std() / 20, rel=0.08)
