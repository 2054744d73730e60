"""Normal equations as products of matrices: what sums over frames written out say."""

import numpy as np
import pytest

from bns.diagnose.estimate.noise import HUBER, huber
from bns.diagnose.estimate.normal_equations import innovations_after, normal_equations, normal_equations_by_trial

FIRST = np.array([0, 7, 7, 20])
"""The second trial was never tracked."""
RNG = np.random.default_rng(0)
JACOBIAN, WHITE = RNG.normal(size=(20, 3, 4)), 3 * RNG.normal(size=(20, 3))


def written_out(rows):
    length = np.linalg.norm(WHITE[rows], axis=1)
    weight = np.minimum(1, HUBER / length)
    curvature = sum(w * j.T @ j for w, j in zip(weight, JACOBIAN[rows], strict=True))
    gradient = sum(w * j.T @ e for w, j, e in zip(weight, JACOBIAN[rows], WHITE[rows], strict=True))
    return curvature, gradient


def test_all_frames():
    for found, expected in zip(normal_equations(JACOBIAN, WHITE), written_out(slice(None)), strict=True):
        np.testing.assert_allclose(found, expected)


def test_each_trial_and_none_where_nothing_was_tracked():
    found = normal_equations_by_trial(FIRST, JACOBIAN, WHITE)
    for trial, rows in ((0, slice(0, 7)), (2, slice(7, 20))):
        curvature, gradient = written_out(rows)
        np.testing.assert_allclose(found.curvatures[trial], curvature)
        np.testing.assert_allclose(found.gradients[trial], gradient)
    assert not found.curvatures[1].any()
    assert not found.gradients[1].any()


def test_the_gradient_is_that_of_the_robust_loss():
    step = 1e-6 * RNG.normal(size=4)
    steps = np.tile(step, (3, 1))
    change = huber(innovations_after(FIRST, JACOBIAN, WHITE, steps)).sum() - huber(WHITE).sum()
    assert change == pytest.approx(normal_equations(JACOBIAN, WHITE)[1] @ step, rel=1e-3)


def test_every_trial_takes_its_own_step():
    steps = RNG.normal(size=(3, 4))
    moved = innovations_after(FIRST, JACOBIAN, WHITE, steps)
    np.testing.assert_allclose(moved[3], WHITE[3] + JACOBIAN[3] @ steps[0])
    np.testing.assert_allclose(moved[19], WHITE[19] + JACOBIAN[19] @ steps[2])


def test_no_numbers_no_equations():
    curvature, gradient = normal_equations(JACOBIAN[..., :0], WHITE)
    assert (curvature.shape, gradient.shape) == ((0, 0), (0,))
    np.testing.assert_array_equal(innovations_after(FIRST, JACOBIAN[..., :0], WHITE, np.zeros((3, 0))), WHITE)


def test_the_robust_loss_goes_on_along_its_tangent_beyond_its_bend():
    far = np.array([0.0, 1.0, HUBER, HUBER + 1.0, HUBER + 10.0])
    along = np.stack([0.6 * far, np.zeros(5), -0.8 * far], axis=1)
    assert huber(along) == pytest.approx(HUBER**2 / 2 + np.array([-(HUBER**2) / 2, (1 - HUBER**2) / 2, 0, HUBER, 10 * HUBER]))
