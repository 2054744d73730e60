"""How sure a ranking is that was cut short: confidence that holds however often one has looked before.

A combination's seeds are in no order that matters, so its results are draws without replacement from those of the
complete sweep. If its total over all N seeds is at least T, the next result has the conditional mean (T - sum so far) /
(seeds left) or more, and a bettor on less than that does not gain on average: by Ville's inequality a capital of c or
more is reached at any time with a chance of 1/c at most (Waudby-Smith and Ramdas, "Confidence sequences for sampling
without replacement", NeurIPS 2020, section 3; "Estimating means of bounded random variables by betting", JRSS B 2024,
section 5).
"""

from __future__ import annotations

import numpy as np

from bns.sweep.ranking.race import Results

_STAKES = (0.3, 0.6, 0.9)
"""Shares of the capital that are staked; the mean of the three capitals is a capital again."""
_SLACK = 1e-9


def capital(outcomes: np.ndarray, seeds: int, total: float) -> float:
    """The largest capital so far of a bettor against the total of ``seeds`` results being ``total`` or more.

    ``outcomes`` (k,): results from 0 to 1 in the order of the seeds. Infinite if that total is out of reach.
    """
    before = np.concatenate([[0.0], np.cumsum(outcomes)])
    if total - before[-1] > seeds - len(outcomes) + _SLACK:
        return float("inf")
    mean = np.clip((total - before[:-1]) / (seeds - np.arange(len(outcomes))), 0.0, 1.0 - _SLACK)
    capitals = [np.cumprod(np.concatenate([[1.0], 1.0 + stake * (mean - outcomes) / (1.0 - mean)])) for stake in _STAKES]
    return float(np.mean(capitals, axis=0).max())


def confidences(results: Results, best: list[int], top: int) -> list[float]:
    """Confidence, 0 to 1, that each of ``best`` (whole, best first) is among the ``top`` of the complete sweep.

    The r-th is not only if top - r + 1 or more of the combinations that are left end level with it or above. The chance
    that one of so many has a capital of c is (top - r + 1) / c at most.
    """
    low, high = results.bounds()
    seeds = results.success.shape[1]
    found = []
    for rank, combination in enumerate(best, 1):
        rivals = np.nonzero(~results.whole & (high >= low[combination] - _SLACK))[0]
        places = top - rank + 1
        if len(rivals) < places:
            found.append(1.0)
            continue
        target = float(low[combination]) * seeds
        won = sorted(capital(_optimistic(results, rival), seeds, target) for rival in rivals.tolist())
        found.append(max(0.0, 1.0 - places / won[places - 1]))
    return found


def _optimistic(results: Results, combination: int) -> np.ndarray:
    """Its results in the order of the seeds, a failed run as a success: the mean without it is no larger."""
    row, seen = results.success[combination], results.seen[combination]
    return np.where(np.isnan(row[seen]), 1.0, row[seen])
