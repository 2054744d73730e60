"""Where the robot really was, from a distorted picture."""

import numpy as np
import pytest

from bns.diagnose.predict.pictures import undone
from bns.physics.effects import effect_named
from bns.physics.signals import View

RNG = np.random.default_rng(0)
REALLY = np.column_stack([RNG.uniform(-0.7, 2.3, (500, 2)), RNG.uniform(-3, 3, 500)])


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("tilted-camera", {"x_per_m": -0.07, "y_per_m": 0.06}),
        ("lens-distortion", {"per_m2": 0.12, "x_m": 0.7, "y_m": 0.4}),
        ("lens-distortion", {"per_m2": -0.03, "x_m": 0.7, "y_m": 0.4}),
    ],
)
def test_strong_distortions_are_undone_at_the_edge_of_the_floor(name, values):
    """The worst of these stretches distances from the centre by half: plain repetition led away from the place there."""

    def picture(poses):
        return effect_named(name).apply(View(poses), **values).poses

    found = undone(picture, picture(REALLY))
    np.testing.assert_allclose(found[:, :2], REALLY[:, :2], atol=1e-5)
    np.testing.assert_allclose(found[:, 2], REALLY[:, 2], atol=1e-5)
