"""Whether two columns go together: an interval that covers, and a verdict also where there is no relation at all."""

import numpy as np
import pytest

from analysis.checks import diversity
from analysis.intervals import rank_correlation
from analysis.verdicts import AGREES, DIFFERS, UNDECIDED


def normal_pair(correlation, count, draw):
    first = draw.normal(size=count)
    return first, correlation * first + np.sqrt(1 - correlation**2) * draw.normal(size=count)


@pytest.mark.parametrize("correlation", [0.0, 0.4, 0.8])
def test_interval_covers_the_rank_correlation_of_normal_pairs(correlation):
    """The true one is 6/pi asin(r/2) (Kruskal 1958)."""
    draw, true = np.random.default_rng(3), 6 / np.pi * np.arcsin(correlation / 2)
    ends = np.array([rank_correlation(*normal_pair(correlation, 60, draw))[1:] for _ in range(400)])
    assert 0.92 < ((ends[:, 0] <= true) & (true <= ends[:, 1])).mean() < 0.98


def test_a_perfect_order_and_too_few_pairs():
    found, low, high = rank_correlation(range(10), range(10))
    assert found == pytest.approx(1)
    assert 0.99 < low <= high <= 1
    assert np.isnan(rank_correlation([1, 2, 3], [1, 3, 2])[1:]).all()


@pytest.mark.parametrize(
    ("correlation", "count", "verdicts"),
    [
        (0.5, 400, (AGREES, DIFFERS)),
        (-0.5, 400, (DIFFERS, AGREES)),
        (0.0, 1500, (DIFFERS, DIFFERS)),
        (0.1, 400, (UNDECIDED, DIFFERS)),
        (0.0, 100, (UNDECIDED, UNDECIDED)),
    ],
)
def test_no_relation_differs_from_either_direction_once_there_are_enough_pairs(correlation, count, verdicts):
    first, second = normal_pair(correlation, count, np.random.default_rng(0))
    second -= first * (np.cov(first, second)[0, 1] / first.var() - correlation)  # as asked, but for rounding by ranks
    assert tuple(diversity._related(first, second, way)[1] for way in ("grows", "falls")) == verdicts
