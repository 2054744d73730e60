"""The scatter of a drive as the cause of an error: compared with a walk at random that is drawn here, frame by frame."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.residuals.drive_scatter import scatter_in_words, wandering_m

NOISE = np.array([0.001, 0.005, 0.004, 0.002, 0.02])
"""Of a pose (m, rad); of the drive for a metre: ahead, aside (m), heading (rad)."""


def robot(path, windows):
    """A predictor of one path, (frames, 2)."""
    way_m = np.append(0.0, np.hypot(*np.diff(path, axis=0).T))
    starts, ends = np.transpose(windows)
    return SimpleNamespace(tracks=SimpleNamespace(pose=path), way_m=way_m, windows=lambda _: (starts, ends))


def curved(frames=200):
    angle = np.linspace(0, 2.5, frames)
    return np.column_stack([np.sin(angle), 1 - np.cos(angle)]) * 0.8


def drawn_mm(path, start, end, rng, times=4000):
    """Root mean square distance between the end of the path and where it leads if each step scatters as NOISE says."""
    steps = np.diff(path[start : end + 1], axis=0)
    way = np.hypot(*steps.T)
    turned = np.cumsum(rng.normal(size=(times, len(way))) * NOISE[4] * np.sqrt(way), axis=1)
    cos, sin = np.cos(turned), np.sin(turned)
    scatter = rng.normal(size=(2, times, len(way))) * NOISE[2:4, None, None] * np.sqrt(way)
    heading = np.arctan2(*steps.T[::-1]) + turned
    x = (cos * steps[:, 0] - sin * steps[:, 1] + scatter[0] * np.cos(heading) - scatter[1] * np.sin(heading)).sum(axis=1)
    y = (sin * steps[:, 0] + cos * steps[:, 1] + scatter[0] * np.sin(heading) + scatter[1] * np.cos(heading)).sum(axis=1)
    return 1e3 * np.sqrt(((x - steps[:, 0].sum()) ** 2 + (y - steps[:, 1].sum()) ** 2).mean())


@pytest.mark.parametrize(("start", "end"), [(0, 199), (20, 90)])
def test_the_error_is_that_of_a_walk_at_random(start, end):
    path = curved()
    expected = drawn_mm(path, start, end, np.random.default_rng(0))
    assert 1e3 * wandering_m(robot(path, [(start, end)]), NOISE, "trial") == pytest.approx(expected, rel=0.04)


def test_windows_count_by_their_mean_squares():
    path = curved()
    both, first, second = (wandering_m(robot(path, w), NOISE, "trial") for w in ([(0, 90), (90, 199)], [(0, 90)], [(90, 199)]))
    assert both**2 == pytest.approx((first**2 + second**2) / 2)
    assert np.isnan(wandering_m(robot(path, np.zeros((0, 2), dtype=int)), NOISE, "trial"))


def errors(rms_m, floor_m=0.002, windows=5):
    models = (SimpleNamespace(rms_m=1.0), SimpleNamespace(rms_m=rms_m))
    at = SimpleNamespace(models=models, noise_floor_m=floor_m, windows=windows)
    empty = SimpleNamespace(models=(SimpleNamespace(rms_m=np.nan),), noise_floor_m=np.nan, windows=0)
    return SimpleNamespace(horizons={"command": at, "5s": at, "trial": empty})


def test_it_is_said_where_it_makes_the_error_and_the_error_is_above_noise():
    predictor = robot(curved(), [(0, 199)])
    by_drive = wandering_m(predictor, NOISE, "5s")
    (said,) = scatter_in_words(predictor, NOISE, errors(1.2 * by_drive))
    assert f"over 5 seconds ({1.2e3 * by_drive:.3g} mm)" in said
    assert f"which makes {1e3 * by_drive:.3g} mm" in said
    assert "4 mm ahead, 2 mm to the side and 1.15°" in said
    assert scatter_in_words(predictor, NOISE, errors(1.7 * by_drive)) == []  # something else makes most of it
    assert scatter_in_words(predictor, NOISE, errors(0.6 * by_drive)) == []  # it scatters in another way
    assert scatter_in_words(predictor, NOISE, errors(by_drive, floor_m=0.6 * by_drive)) == []  # near noise: no question
    assert scatter_in_words(predictor, NOISE, errors(by_drive, floor_m=np.nan)) == []
    assert scatter_in_words(predictor, NOISE, SimpleNamespace(horizons={})) == []
