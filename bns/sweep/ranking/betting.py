"""Evidence against a total that is not yet known, valid however often and whenever one looks.

A combination's seeds are in no order that matters, so its results are draws without replacement from those of the
complete sweep. If its total over all N seeds is at least T, the next result has the conditional mean (T - sum so far) /
(seeds left) or more, and a bettor on less than that does not gain on average: by Ville's inequality a capital of c or
more is reached at any time with a chance of 1/c at most (Waudby-Smith and Ramdas, "Confidence sequences for sampling
without replacement", NeurIPS 2020, section 3; "Estimating means of bounded random variables by betting", JRSS B 2024,
section 5). Stakes are the same for every T, so the capital against a larger total is never smaller: a bet against what
is known to be less than T is one against T, too.
"""

from __future__ import annotations

import numpy as np

_STAKES = (0.75, 0.95)
"""Shares of the capital that are staked; the mean of the capitals is a capital again."""
_SLACK = 1e-9


def course(outcomes: np.ndarray, seen: np.ndarray, total: float) -> np.ndarray:
    """The largest capital until each seed (combinations, seeds) of bettors against totals of ``total`` or more.

    ``outcomes`` (combinations, seeds): from 0 to 1, whatever where not ``seen``. Infinite once that total is out of reach.
    """
    seeds, gained = seen.shape[1], np.where(seen, outcomes, 0.0)
    left, sums = seeds - np.cumsum(seen, axis=1), np.cumsum(gained, axis=1)
    mean = np.clip((total - sums + gained) / np.maximum(left + seen, 1), 0.0, 1.0 - _SLACK)
    pays = [np.where(seen, 1.0 + stake * (mean - gained) / (1.0 - mean), 1.0) for stake in _STAKES]
    capitals = np.mean([np.cumprod(each, axis=1) for each in pays], axis=0)
    found: np.ndarray = np.maximum.accumulate(np.where(total - sums > left + _SLACK, np.inf, capitals), axis=1)
    return found


def capital(outcomes: np.ndarray, seen: np.ndarray, total: float) -> np.ndarray:
    """The largest capital so far of each bettor (combinations,), at least the 1 that it began with."""
    return np.maximum(course(outcomes, seen, total)[:, -1], 1.0)
