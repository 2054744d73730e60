"""A speed of an effect is bounded by those driven: a Stribeck loss that does not fade over them is a dead zone."""

import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.starts import fitting
from bns.physics.effects import effect_named
from tests.diagnose.worlds import NOMINAL, measured


@pytest.mark.parametrize("speeds", [(-0.12, 0.08), (-0.08, 0.12)])
def test_a_speed_at_which_something_fades_is_at_most_twice_the_fastest_driven(speeds):
    tracks = tracks_of(measured(NOMINAL, trials=3, seed=1, speeds=speeds))
    fastest = max(abs(tracks.left_m_s).max(), abs(tracks.right_m_s).max())
    width, fade = fitting(effect_named("stribeck"), NOMINAL, tracks).parameters
    assert fade.high == pytest.approx(2 * fastest)
    assert fade.plausible[1] == pytest.approx(min(2 * fastest, 0.5))
    assert width == effect_named("stribeck").parameters[0]


def test_starts_are_drawn_in_and_none_is_told_twice():
    slow = effect_named("stribeck").told(0.01)
    assert slow.parameters[1].high == pytest.approx(0.02)
    assert slow.starts == ((0.005, 0.01), (0.02, 0.01), (0.005, 0.02), (0.02, 0.02))
    assert slow.parameters[1].neutral == pytest.approx(0.02)


def test_effects_without_such_a_speed_stay_as_they_are():
    effect = effect_named("dead-zone")
    assert effect.told(0.1) is effect
