"""How stretches of a body scatter: whitened errors are independent, and the noise that made them is found again."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from bns.diagnose.estimate.stretch_noise import (
    _apart_scatter,
    _Sums,
    errors_since_begin,
    estimate_stretch_noise,
    predicted_since_begin,
    stretch_filter,
)
from bns.diagnose.predict.base import Steps
from bns.diagnose.predict.luck import Luck, since_begin

FRAMES = 3
NOISE = np.array([1.5e-3, 4e-3, 3e-3, 8e-3, 2.0, 0.5])
APART_M = 2e-3


def composed(begins, body):
    """Poses (stretches, frames, 3) from begins (stretches, 3) and displacements (stretches, frames, 3), one after the other."""
    pose = np.repeat(begins[:, None], body.shape[1], axis=1)
    for k in range(1, body.shape[1]):
        heading = pose[:, k - 1, 2]
        pose[:, k, 0] = pose[:, k - 1, 0] + np.cos(heading) * body[:, k, 0] - np.sin(heading) * body[:, k, 1]
        pose[:, k, 1] = pose[:, k - 1, 1] + np.sin(heading) * body[:, k, 0] + np.cos(heading) * body[:, k, 1]
        pose[:, k, 2] = heading + body[:, k, 2]
    return pose


def moved(pose, by):
    """Poses (stretches, frames, 3) moved in the frame of the first of each stretch."""
    out, (c, s) = pose.copy(), (np.cos(pose[:, :1, 2]), np.sin(pose[:, :1, 2]))
    out[..., 0] += c * by[..., 0] - s * by[..., 1]
    out[..., 1] += s * by[..., 0] + c * by[..., 1]
    out[..., 2] += by[..., 2]
    return out


def driven(stretches, seed):
    """A predictor of stretches that are as the model says but for luck and noise, and the model's steps."""
    rng = np.random.default_rng(seed)
    body = rng.normal(size=(stretches, FRAMES, 3)) * [0.05, 0.02, 0.2]
    body[:, 0] = 0.0
    true = composed(rng.uniform(-3, 3, (stretches, 3)), body)
    share = np.arange(FRAMES)[None, :, None] / (FRAMES - 1)
    columns = rng.normal(size=(stretches, FRAMES, 4, 2)) * np.array([0.01, 0.01, 0.03, 1e-4])[:, None] * share[..., None]
    lucky = np.einsum("sfcm,sm->sfc", columns, rng.normal(size=(stretches, 2)) * NOISE[4:])
    drift = share * (rng.normal(size=(stretches, 1, 3)) * NOISE[[2, 2, 3]])
    seen = moved(true, lucky[..., :3] + drift) + rng.normal(size=true.shape) * NOISE[[0, 0, 1]]
    apart = lucky[..., 3] + APART_M * rng.normal(size=true.shape[:2])
    number = np.repeat(np.arange(stretches), FRAMES)
    luck = Luck(columns.reshape(-1, 4, 2), np.array([0, 1]), number, np.arange(stretches) * FRAMES)
    tracks = SimpleNamespace(pose=seen.reshape(-1, 3))
    steps = Steps(body.reshape(-1, 3), np.zeros((stretches * FRAMES, 2)), apart.reshape(-1, 1))
    return SimpleNamespace(luck=luck, tracks=tracks, tracking=None), steps


def test_steps_put_together_are_the_poses_that_they_lead_to():
    rng = np.random.default_rng(0)
    body = rng.normal(size=(4, FRAMES, 3))
    body[:, 0] = 0.0
    begins = rng.normal(size=(4, 3))
    pose = composed(begins, body).reshape(-1, 3)
    luck = Luck(np.zeros((12, 3, 0)), np.zeros(0, dtype=np.int64), np.repeat(np.arange(4), FRAMES), np.arange(4) * FRAMES)
    steps = Steps(body.reshape(-1, 3), np.zeros((12, 2)))
    together = predicted_since_begin(luck, pose, steps)
    expected = since_begin(pose, luck.begins, luck.stretch)
    assert together[:, :2] == pytest.approx(expected[:, :2])
    assert np.cos(together[:, 2] - expected[:, 2]) == pytest.approx(np.ones(12))
    east = Steps(steps.body, np.tile([1.0, 0.0], (12, 1)))
    change = predicted_since_begin(luck, pose, east) - together
    assert np.hypot(*change[2::3, :2].T) == pytest.approx([2.0] * 4)  # two frames of a metre each
    assert change[2::3, 0] == pytest.approx(2 * np.cos(begins[:, 2]))
    assert change[2::3, 1] == pytest.approx(-2 * np.sin(begins[:, 2]))
    north = predicted_since_begin(luck, pose, Steps(steps.body, np.tile([0.0, 1.0], (12, 1)))) - together
    assert north[2::3, 0] == pytest.approx(2 * np.sin(begins[:, 2]))
    assert north[2::3, 1] == pytest.approx(2 * np.cos(begins[:, 2]))


def test_whitened_errors_have_the_length_that_their_covariance_gives_them():
    predictor, steps = driven(5, seed=1)
    pose_filter = stretch_filter(predictor, steps, NOISE)
    whitened = pose_filter.whitened(predictor.tracks, steps)
    errors = errors_since_begin(predictor.luck, predictor.tracks.pose, steps)
    for stretch in range(5):
        rows = slice(stretch * FRAMES, (stretch + 1) * FRAMES)
        a = pose_filter.columns[rows].reshape(FRAMES * 4, -1)
        z = (errors[rows] / pose_filter.scale).ravel()
        exact = z @ np.linalg.solve(np.eye(FRAMES * 4) + a @ a.T, z)
        assert (whitened[rows] ** 2).sum() == pytest.approx(exact)


def test_the_surprise_at_a_noise_is_that_of_the_normal_distribution_with_its_covariance():
    predictor, steps = driven(5, seed=1)
    luck, pose = predictor.luck, predictor.tracks.pose
    sums = _Sums.of(luck, pose, steps, _apart_scatter(steps))
    errors, surprises = errors_since_begin(luck, pose, steps), []
    for noise in (NOISE, 1.5 * NOISE, NOISE * [1, 1, 2, 1, 1, 3]):
        pose_filter = stretch_filter(predictor, steps, noise)
        exact = 0.0
        for stretch in range(5):
            inner = slice(stretch * FRAMES + 1, (stretch + 1) * FRAMES)
            a = pose_filter.columns[inner].reshape((FRAMES - 1) * 4, -1)
            root = np.diag(np.tile(pose_filter.scale, FRAMES - 1))
            covariance = root @ (np.eye(len(a)) + a @ a.T) @ root
            exact -= multivariate_normal(cov=covariance).logpdf(errors[inner].ravel())
        surprises.append((sums.surprise(luck, noise), exact))
    found, exact = np.array(surprises).T
    assert np.diff(found) == pytest.approx(np.diff(exact))


@pytest.mark.parametrize(
    ("frames", "off", "said"),
    [
        (1, 3.0, 4.5),
        (1, 3.5, 6.125),
        (1, 10.0, 28.875),  # 3.5 times 10, less half of 3.5 squared
        (4, 5.0, 12.5),
        (4, 10.0, 38.634),  # likewise from 5.232: 3.5 and by how much the roots of 12 and of 3 differ
    ],
)
def test_an_error_far_longer_than_usual_counts_linearly(frames, off, said):
    """Of one stretch under unit noise: three numbers a frame, squares in full up to 3.5 for three numbers."""
    luck = Luck(np.zeros((frames + 1, 3, 0)), np.zeros(0, dtype=np.int64), np.zeros(frames + 1, dtype=np.int64), np.zeros(1, int))
    squares, entries = np.array([[off**2], [0.0], [0.0]]), np.array([[2.0 * frames], [1.0 * frames]])
    sums = _Sums(squares, np.zeros((3, 1, 6)), np.zeros((3, 1, 6, 6)), entries)
    assert sums.surprise(luck, np.ones(4)) == pytest.approx(said, abs=1e-3)


def test_the_noise_that_was_put_in_is_estimated_and_leaves_unit_errors():
    predictor, steps = driven(150, seed=2)
    noise = estimate_stretch_noise(predictor, steps)
    assert noise[[0, 2, 4, 5]] == pytest.approx(NOISE[[0, 2, 4, 5]], rel=0.3)
    whitened = stretch_filter(predictor, steps, noise).whitened(predictor.tracks, steps)
    inner = np.arange(len(whitened)) % FRAMES > 0
    assert (whitened[inner] ** 2).mean(axis=0) == pytest.approx(np.ones(4), abs=0.25)


def test_tracking_noise_is_no_larger_than_the_tracks_say():
    predictor, steps = driven(60, seed=3)
    predictor.tracking = (5e-4, 1e-3)
    noise = estimate_stretch_noise(predictor, steps)
    assert (noise[:2] <= np.array([5e-4, 1e-3]) * 1.0001).all()
    assert noise[2] > NOISE[2]  # the drift takes what is left
