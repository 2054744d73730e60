"""A slope is a cable from far away: how far the anchor is said to be is no more certain than the tracks make it."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.fit_set import fit_set
from bns.diagnose.estimate.parameters import FreeParameter
from bns.diagnose.estimate.plausibility import half_as_far
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


def test_where_the_tracks_allow_a_cable_that_is_nearer_it_competes():
    """Few trials, of which only the ends of commands were seen by a poor camera: 9 m are as good as 15, and as a slope."""
    pull = hidden(tether_pull={"pull_per_s": 0.0009, "anchor_x_m": 9.0, "anchor_y_m": 0.0})
    poor = measured(pull, trials=12, seed=5, speeds=(-0.2, 0.2), noise=(0.004, 0.02), ends_only=True)
    found = StepwiseSelection(WheelPredictor(tracks_of(poor)), NOMINAL).run()
    assert {found.accepted, *found.competing_models} >= {("floor-slope",), ("tether-pull",)}


def fitted(east_m, north_m):
    effect = effect_named("tether-pull")
    numbers = tuple(replace(p, low=-20.0, high=24.0) if p.floor_axis else p for p in effect.parameters)
    own = replace(effect, parameters=numbers)
    model = NOMINAL.with_active(own, (0.001, east_m, north_m))
    free = tuple(FreeParameter(own.name, p) for p in numbers)
    return SimpleNamespace(model=model, free=free, values=[0.001, east_m, north_m], se=lambda _: 0.1)


def test_places_as_far_away_as_they_may_be_are_bounded_at_half_of_that():
    """Half as far from the middle of where they may be, which is that of the floor: 2 m."""
    assert half_as_far(fitted(9.0, -3.0), "tether-pull") is None
    assert half_as_far(fitted(24.0, -3.0), "floor-slope") is None
    nearer = half_as_far(fitted(24.0, -3.0), "tether-pull")
    assert nearer.values_of("tether-pull") == {"pull_per_s": 0.001, "anchor_x_m": 13.0, "anchor_y_m": -3.0}
    bounds = {p.name: (p.low, p.high) for p in nearer.effects[0].effect.parameters}
    assert bounds["anchor_x_m"] == (-9.0, 13.0)
    assert bounds["anchor_y_m"] == (-20.0, 24.0)
