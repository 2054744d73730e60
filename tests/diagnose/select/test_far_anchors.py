"""A slope is a cable from far away: how far the anchor is said to be is no more certain than the tracks make it."""

import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.fit_set import fit_set
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.select.stepwise import StepwiseSelection
from bns.physics.effects import effect_named
from tests.diagnose.worlds import NOMINAL, hidden, measured

SLOPE = hidden(floor_slope={"x_m_s": 0.008, "y_m_s": 0.0})


@pytest.fixture(scope="module")
def predictor():
    return WheelPredictor(tracks_of(measured(SLOPE, trials=24, seed=5, speeds=(-0.2, 0.2))))


def test_the_interval_of_an_anchor_far_away_is_wide(predictor):
    """A step for the slope along the pull once moved the robot by twenty standard deviations: the interval was 2 m wide."""
    fit = fit_set(predictor, NOMINAL, [effect_named("tether-pull")])[1]
    found = {number.parameter.name: fit.interval(i) for i, number in enumerate(fit.free)}
    low, high = found["anchor_x_m"]
    assert high - low > 5.0
    assert found["pull_per_s"][1] > 1.5 * found["pull_per_s"][0]


def test_a_slope_has_no_rival_in_a_cable_that_would_be_farther_away_than_any(predictor):
    found = StepwiseSelection(predictor, NOMINAL).run()
    assert found.accepted == ("floor-slope",)
    assert ("tether-pull",) not in found.competing_models
