"""Intervals of shares, and what a figure says of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from statsmodels.stats.proportion import proportion_confint

INTERVALS = "pointwise 95 % Wilson intervals"
"""For the note on a figure."""
INDEPENDENCE = "pointwise; runs taken as independent, though combinations share their seeds"
"""For its caption: all combinations have the luck of a seed in common, which the intervals know nothing of."""


def wilson(successes: Any, runs: Any) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the Wilson 95 % interval of a share, each as the arguments, in 0..1."""
    low, high = proportion_confint(np.asarray(successes), np.asarray(runs), alpha=0.05, method="wilson")
    return np.asarray(low), np.asarray(high)
