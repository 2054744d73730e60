"""What a person reads where formulas have bare names."""

import numpy as np
import pytest

from bns.diagnose.comparison import BINS, _binned
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.data.variables import LABELS, label
from bns.diagnose.predict.wheels import WheelPredictor
from bns.robots.snake.table import GAIT
from tests.diagnose.worlds import NOMINAL, measured


def test_every_variable_of_a_robot_with_wheels_has_words_of_its_own():
    names = WheelPredictor(tracks_of(measured(NOMINAL, trials=2))).variables()
    assert names
    assert not [name for name in names if name not in LABELS]


def test_so_has_every_number_of_a_cycle():
    assert not [name for name in (*GAIT, *(f"previous_{name}" for name in GAIT), "cycle", "change") if name not in LABELS]


def test_no_two_variables_read_alike():
    assert len(set(LABELS.values())) == len(LABELS)


def test_a_logged_column_keeps_its_own_name():
    assert label("battery_v") == "battery_v"


def test_values_that_nearly_repeat_share_a_bin_of_a_curve():
    rng = np.random.default_rng(0)
    fading = np.concatenate([1e-6 * rng.random(300), rng.uniform(0.01, 0.1, 60)])
    curve = _binned("left_change_m_s", "forward", fading, np.ones(360), np.arange(360) % 12, rng)
    assert np.diff(curve.centre).min() > np.ptp(fading) / BINS**2
    assert len(curve.centre) >= 2
    even = _binned("speed_m_s", "forward", np.linspace(0, 1, 360), np.ones(360), np.arange(360) % 12, rng)
    assert len(even.centre) == BINS
    alike = _binned("speed_m_s", "forward", np.full(360, 0.2), np.ones(360), np.arange(360) % 12, rng)
    assert alike.centre == pytest.approx([0.2])
