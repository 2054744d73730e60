"""The error in bins: each bin's root mean square, an interval over whole trials, and no interval where there are too few."""

from itertools import pairwise

import numpy as np
import pytest

from bns.app.figures.bands import MOST_BINS, band
from bns.diagnose.predict.paired_errors import FEWEST_TRIALS

TRIALS, EACH = 30, 20


@pytest.fixture
def errors():
    rng = np.random.default_rng(3)
    x = rng.uniform(0, 10, TRIALS * EACH)
    return x, 2 + x + rng.normal(size=len(x)), np.repeat(np.arange(TRIALS), EACH)


def test_every_window_counts_in_one_bin(errors):
    found = band(*errors)
    assert len(found.x) == MOST_BINS
    edges = np.quantile(errors[0], np.linspace(0, 1, MOST_BINS + 1))
    for n, (low, high) in enumerate(pairwise(edges)):  # the slow way
        inside = [e for x, e in zip(*errors[:2], strict=True) if (low < x <= high or (n == 0 and x == low))]
        assert found.rms[n] == pytest.approx(np.sqrt(np.mean(np.square(inside))))
    assert (np.diff(found.x) > 0).all()
    assert (found.low < found.rms).all()
    assert (found.rms < found.high).all()


def test_trials_are_drawn_whole(errors):
    """Errors that are alike within a trial say less than as many that are not."""
    x, error, trial = errors
    alike = 5 + np.random.default_rng(1).normal(size=TRIALS)[trial]
    mixed = np.random.default_rng(2).permutation(alike)
    width = [np.median(b.high - b.low) for b in (band(np.ones_like(x), e, trial) for e in (alike, mixed))]
    assert width[0] > 2 * width[1]
    assert (error > 0).any()


def test_of_few_trials_there_is_no_interval(errors):
    x, error, trial = errors
    few = trial < FEWEST_TRIALS - 1
    found = band(x[few], error[few], trial[few])
    assert np.isfinite(found.rms).all()
    assert np.isnan(found.low).all()


def test_equal_values_stay_in_one_bin_and_unknown_ones_in_none():
    x = np.array([1.0] * 300 + [2.0] * 20 + [np.nan] * 7)
    found = band(x, np.where(np.isnan(x), 99.0, x), np.arange(len(x)) % 40)
    assert found.x.tolist() == [1.0, 2.0]
    assert found.rms.tolist() == [1.0, 2.0]
    assert len(band(np.zeros(0), np.zeros(0), np.zeros(0, dtype=int)).x) == 0
