"""A body that is seen at other times than it is looked at in its simulation moves as far there as it does."""

import numpy as np
import pytest

import bns
from bns.diagnose.predict.stretches import _between
from tests.jointed.arm import log, xml


def test_between_looks_a_body_is_on_the_cubic_through_four_of_them():
    """Stretches of five, three and two looks."""
    look_s = np.array([0.0, 0.02, 0.04, 0.06, 0.08, 0.0, 0.02, 0.04, 0.0, 0.02])
    powers = np.array([3] * 5 + [2] * 3 + [1] * 2)
    since_s = np.array([0.0, 0.013, 0.05, 0.08, 0.079, 0.01, 0.033, 0.04, 0.005])
    first, last = np.array([0] * 5 + [5] * 3 + [8]), np.array([4] * 5 + [7] * 3 + [9])
    lower = np.array([0, 0, 2, 3, 3, 5, 6, 6, 8])
    points = (2.0 - look_s**powers)[:, None, None] * np.array([[1.0, 2.0], [-3.0, 0.5]])
    found = _between(points, look_s, since_s, lower, first, last)
    expected = 2.0 - since_s ** np.array([3] * 5 + [2] * 3 + [1])
    np.testing.assert_allclose(found, expected[:, None, None] * np.array([[1.0, 2.0], [-3.0, 0.5]]), rtol=1e-12)


@pytest.mark.parametrize("seen_every", [8, 6])
def test_an_arm_that_is_its_model_moves_as_far_as_that_at_any_rate_of_frames(tmp_path, seen_every):
    """At 31 and 42 Hz. On straight lines between looks at 25 Hz the model moved less, and the arm was `unlisted`."""
    (tmp_path / "arm.xml").write_text(xml())
    table = log(14, seed=3, noise_m=1e-4, seen_every=seen_every)
    found = bns.diagnose(table, bns.Model(tmp_path / "arm.xml"))
    assert found.verdict == "none"
