"""One-sided tests as SciPy has them, without waiting for `scipy.stats`: the import alone takes as long as many figures."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd


def rank_correlation(a: pd.Series, b: pd.Series, *, rises: bool) -> tuple[float, float]:
    """Spearman's, and the chance of one so large (small, unless it ``rises``) by Student's t: `scipy.stats.spearmanr`."""
    from scipy.special import stdtr  # noqa: PLC0415  # only where something is compared

    r, free = float(np.corrcoef(a.rank(), b.rank())[0, 1]), len(a) - 2
    t = r * math.sqrt(free / max((1 + r) * (1 - r), np.finfo(float).tiny))
    return r, float(stdtr(free, -t if rises else t))


def fewer(counts: list[list[int]]) -> float:
    """Fisher's exact chance of so few in the upper left, rows and columns of the table given: `scipy.stats.fisher_exact`."""
    (here, not_here), (there, not_there) = counts
    hits, drawn, of = here + there, here + not_here, here + not_here + there + not_there
    ways = sum(math.comb(hits, k) * math.comb(of - hits, drawn - k) for k in range(max(0, drawn - of + hits), here + 1))
    return ways / math.comb(of, drawn)
