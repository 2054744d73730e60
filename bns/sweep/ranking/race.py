"""Which runs decide the best combinations of a finite sweep: successive elimination by what is still possible.

The complete sweep has N seeds a combination, so the mean success of a combination that was run on some of them is
known within bounds: the seeds that are left may all succeed or all fail. A combination whose upper bound lies below the
``top``-th largest lower bound is not among the best, whatever its other seeds do, and is not run any more. The others
are run to the end, so that the ranking is that of the complete sweep, with equals.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_SLACK = 1e-9
_WIDTH = 1.0
"""Combinations advanced at a time, as a multiple of ``top``: a wider round has more work for many processes, and wastes more."""
_SHARE = 6
"""Or this part of those that are left, once as many as ``top`` are whole: fewer rounds in large sweeps."""
_FIRST = 15
"""Before that, a round is this part of the seeds, and the very first is of all combinations."""


@dataclass(frozen=True)
class Results:
    """Of one task. ``success`` (combinations, seeds): from 0 to 1 at a run's end, NaN without; ``seen``: whether it has a result.

    A run that failed is seen and has no success: the mean is over the others.
    """

    success: np.ndarray
    seen: np.ndarray

    @property
    def whole(self) -> np.ndarray:
        """Which combinations have all of their runs (combinations,)."""
        return np.asarray(self.seen.all(axis=1))

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest mean success that each combination can have in the complete sweep."""
        good = ~np.isnan(self.success)
        seeds, count = self.success.shape[1], good.sum(axis=1)
        total = np.where(good, self.success, 0.0).sum(axis=1)
        mean = total / np.maximum(count, 1)
        low, high = total / seeds, (total + seeds - count) / seeds
        return np.where(self.whole, mean, low), np.where(self.whole, mean, high)


def bar(results: Results, top: int) -> float:
    """What a combination must be able to reach: the ``top``-th largest lower bound."""
    low, _ = results.bounds()
    return float(np.sort(low)[-top]) if len(low) >= top else 0.0


def possible(results: Results, top: int) -> np.ndarray:
    """Which combinations can still be among the ``top`` best (combinations,)."""
    able: np.ndarray = results.bounds()[1] >= bar(results, top) - _SLACK
    return able


def next_runs(results: Results, top: int) -> list[tuple[int, int]]:
    """Combination and seed, by their numbers from 0, of the runs to do next; none when the best are known.

    Those that have failed least come first. Once as many as ``top`` are whole, each is advanced by as many seeds as it
    takes to exclude it if all of them fail.
    """
    reach, seeds = bar(results, top), results.success.shape[1]
    _, high = results.bounds()
    left, settled = np.nonzero(possible(results, top) & ~results.whole)[0], int(results.whole.sum()) >= top
    done = results.seen.sum(axis=1)
    order = left[np.lexsort((left, -done[left], -high[left]))]
    width = max(round(_WIDTH * top), len(left) // _SHARE if settled else 0) if done.any() else len(left)
    runs = []
    for combination in order[:width].tolist():
        step = int((high[combination] - reach + _SLACK) * seeds) + 1 if settled else max(1, seeds // _FIRST)
        runs += [(combination, int(seed)) for seed in np.nonzero(~results.seen[combination])[0][:step]]
    return sorted(runs, key=lambda run: (run[1], run[0]))
