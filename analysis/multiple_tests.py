"""p-values of many tests at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def holm(p: Sequence[float] | np.ndarray) -> np.ndarray:
    """p-values (n,) adjusted for their number, in the order given: reject what is below the level (S. Holm, 1979).

    The smallest is multiplied by n, the next by n - 1, …; none is smaller than the one before it, nor above 1.
    """
    given = np.asarray(p, dtype=float)
    order = np.argsort(given)
    stepped = np.maximum.accumulate(given[order] * np.arange(len(given), 0, -1))
    adjusted = np.empty(len(given))
    adjusted[order] = np.minimum(stepped, 1.0)
    return adjusted
