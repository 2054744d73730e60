"""Tests made without `scipy.stats` give its numbers."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import fisher_exact, spearmanr

from analysis.checks.exact_tests import fewer, rank_correlation


@pytest.mark.parametrize(("slope", "levels"), [(0.0, 50), (0.5, 50), (-0.5, 4), (0.2, 3)])
@pytest.mark.parametrize(("rises", "sided"), [(True, "greater"), (False, "less")])
def test_rank_correlations_are_scipy_s(slope, levels, rises, sided):
    draw = np.random.default_rng(3)
    a = pd.Series(draw.integers(levels, size=30).astype(float))
    b = slope * a / levels + pd.Series(draw.normal(size=30))
    theirs = spearmanr(a, b, alternative=sided)
    assert rank_correlation(a, b, rises=rises) == pytest.approx((theirs.statistic, theirs.pvalue), rel=1e-9)


@pytest.mark.parametrize("rises", [True, False])
def test_perfect_order_is_certain(rises):
    r, chance = rank_correlation(pd.Series([1.0, 2.0, 3.0, 4.0]), pd.Series([1.0, 5.0, 6.0, 7.0]), rises=rises)
    assert r == pytest.approx(1.0)
    assert chance == pytest.approx(0.0 if rises else 1.0, abs=1e-6)


@pytest.mark.parametrize("counts", [[[0, 5], [5, 0]], [[3, 4], [2, 9]], [[5, 0], [0, 5]], [[0, 3], [0, 4]], [[4, 1], [9, 30]]])
def test_fisher_s_chance_is_scipy_s(counts):
    assert fewer(counts) == pytest.approx(fisher_exact(counts, alternative="less").pvalue, rel=1e-9)
