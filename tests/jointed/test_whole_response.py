"""The chance of a body's effect goes by its whole response: near a joint that bends no further, the slope says nothing."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.estimate.fit import Problem
from bns.diagnose.estimate.parameters import FreeParameter
from bns.physics.effects import effect_named
from bns.physics.model import load_model

GAIN = effect_named("speed-gain")
LOST_M = np.array([[1.0, 2.0, 3.0], [0.5, 0.0, -1.0]])


def saturated(model):
    """A response that ends where a gain has fallen to 0.8."""
    return LOST_M * min(1.0 - model.values_of("speed-gain")["gain"], 0.2)


@pytest.mark.parametrize(("gain", "column"), [(0.5, LOST_M * 0.2 / -0.5), (0.9, LOST_M * 0.1 / -0.1), (1.0, np.zeros((2, 3)))])
def test_a_chord_is_the_change_from_neutral_and_at_neutral_the_slope(gain, column):
    problem = Problem.__new__(Problem)
    problem.whitened = saturated
    model = load_model("khepera").with_effect("speed-gain", gain=gain)
    free = (FreeParameter("speed-gain", GAIN.parameters[0]),)
    fit = SimpleNamespace(
        model=model, free=free, values=np.array([gain]), whitened=saturated(model), jacobian=np.zeros((2, 3, 1))
    )
    np.testing.assert_allclose(problem._chords(fit, [0])[..., 0], column, atol=1e-12)
