"""A gain and a difference of the wheels that together are one worn wheel: a sentence says so, and only then."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.parameters import FreeParameter
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.single_wheel import single_wheel
from bns.diagnose.predict.wheels import WheelPredictor
from bns.physics.effects import effect_named
from tests.diagnose.worlds import NOMINAL, all_but_rivals_of, hidden, measured


def fit_of(left, right, name="wheel-mismatch", se=0.001, correlation=0.0):
    """As a `Fit`, of wheels whose speeds have these factors."""
    gain, ratio = (left + right) / 2, right / left
    free = tuple(FreeParameter(one, effect_named(one).parameters[0]) for one in ("motor-lag", "speed-gain", name))
    covariance = np.diag([1.0, se**2, (2 * se) ** 2])
    covariance[1, 2] = covariance[2, 1] = correlation * 2 * se**2
    return SimpleNamespace(free=free, values=np.array([0.1, gain, ratio]), covariance=covariance, losses=np.ones(400))


@pytest.mark.parametrize(
    ("left", "right", "said"),
    [
        (1.0, 0.975, "that the left wheel is as in the model, and that the right one turns 2.5 % slower than commanded (95 %"),
        (1.002, 0.975, "that the left wheel is as in the model"),  # 0.28 % is the half of the interval
        (1.004, 0.975, ""),
        (1.03, 1.0, "that the right wheel is as in the model, and that the left one turns 3 % faster than commanded"),
        (1.001, 1.001, ""),  # neither is certainly another
    ],
)
def test_one_wheel_that_is_as_in_the_model_is_told(left, right, said):
    found = list(single_wheel(fit_of(left, right)))
    assert len(found) == bool(said)
    assert all(text.startswith(f"speed-gain and wheel-mismatch together say {said}") for text in found)


def test_a_narrow_interval_has_ends_that_differ():
    (said,) = single_wheel(fit_of(0.96, 1.0, se=1e-5))
    assert "turns 4 % slower than commanded (95 %: 3.997 to 4.003 %)" in said


def test_errors_that_go_together_count():
    """With the gain too high where the ratio is too low the left wheel's factor is less certain, and the right one's more."""
    assert not list(single_wheel(fit_of(1.004, 0.975)))
    assert list(single_wheel(fit_of(1.0035, 0.975, correlation=-1.0)))
    assert not list(single_wheel(fit_of(1.0015, 0.975, correlation=1.0)))


def test_diameters_have_their_own_words_and_other_effects_say_nothing():
    (said,) = single_wheel(fit_of(1.0, 0.975, "wheel-diameters"))
    assert "the right one is 2.5 % smaller than in the model" in said
    problem = problem_for(WheelPredictor(tracks_of(measured(NOMINAL, trials=3))), NOMINAL)
    assert not list(single_wheel(problem.fit(NOMINAL.with_effect("speed-gain", gain=0.99))))
    assert not list(single_wheel(problem.fit(NOMINAL.with_effect("wheel-mismatch", ratio=0.99))))


def test_slopes_are_those_of_the_factors():
    """Standard errors against small changes of both numbers, each as large as its own."""
    (said,) = single_wheel(fit_of(1.0, 0.95, se=0.002))
    numbers = (0.975, 0.95), (0.977, 0.95), (0.975, 0.954)
    right, other_gain, other_ratio = (gain * 2 * ratio / (1 + ratio) for gain, ratio in numbers)
    by = 100 * 1.966 * np.hypot(other_gain - right, other_ratio - right)
    assert f"(95 %: {5 - by:.2g} to {5 + by:.2g} %)" in said


@pytest.mark.slow
def test_a_worn_wheel_is_told_in_the_notes():
    true = hidden(speed_gain={"gain": 0.975}, wheel_mismatch={"ratio": 0.95 / 1.0})
    predictor = WheelPredictor(tracks_of(measured(true, trials=20, seed=11)))
    found = diagnose(predictor, NOMINAL, barred=all_but_rivals_of("speed-gain", "wheel-mismatch"))
    assert set(found.effects) == {"speed-gain", "wheel-mismatch"}
    assert any("the right one turns 5 % slower than commanded" in note for note in found.notes)
