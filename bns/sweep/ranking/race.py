"""Which runs decide the best combinations of a finite sweep: successive elimination by what may still be.

The complete sweep has N seeds a combination, so the mean success of a combination that was run on some of them is
known within bounds: the seeds that are left may all succeed or all fail. The ``top``-th largest lower bound is what a
combination must reach to be among the best. One that cannot, or that has lost so much against a bettor that it would be
too rare among the best, is not run any more. Combinations among the best are run to the end, so that the ranking is
that of the complete sweep.

Of the ``top`` best, one is lost only if its own bettor wins top / (1 - confidence) times the capital; the chance of that
is (1 - confidence) / top for each, however many other combinations there are, and at whatever times one looks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bns.sweep.ranking.betting import capital, course

_SLACK = 1e-9
_WIDTH = 0.7
"""Combinations advanced at a time, as a multiple of ``top``: a wider round has more work for many processes, and wastes more."""
_SHARE = 10
"""Or this part of those that are left, once as many as ``top`` are whole: fewer rounds in large sweeps."""
_FIRST = 15
"""Before that, a round is this part of the seeds, and the very first is of all combinations."""
_PRIOR = 2.0
"""Runs that the mean of all combinations counts for in what a combination is expected to reach."""


@dataclass(frozen=True)
class Aim:
    """What is to be known: the ``top`` best, with which ``confidence`` (1: for certain), within which mean success."""

    top: int
    confidence: float = 0.95
    within: float = 0.0
    """A combination left out may be better than the last of the best by less than this."""

    @property
    def level(self) -> float:
        """The capital against a combination from which on it is not run any more."""
        return self.top / (1.0 - self.confidence) if self.confidence < 1.0 else float("inf")


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

    @property
    def hopeful(self) -> np.ndarray:
        """``success`` with failed runs as successes (combinations, seeds): the mean without them is no larger."""
        return np.where(np.isnan(self.success), np.where(self.seen, 1.0, 0.0), self.success)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest mean success that each combination can have in the complete sweep."""
        good = ~np.isnan(self.success)
        seeds, count = self.success.shape[1], good.sum(axis=1)
        total = np.where(good, self.success, 0.0).sum(axis=1)
        mean = total / np.maximum(count, 1)
        low, high = total / seeds, (total + seeds - count) / seeds
        return np.where(self.whole, mean, low), np.where(self.whole, mean, high)


def bar(results: Results, aim: Aim) -> float:
    """What a combination must be able to reach: the ``top``-th largest lower bound, and more by ``within``.

    With ``within`` only whole combinations count, and before there are enough of them nothing is added: combinations
    between the two bars are left out, so none of them may be needed to fill the ranks.
    """
    low, _ = results.bounds()
    if aim.within and settled(results, aim):
        return float(np.sort(low[results.whole])[-aim.top]) + aim.within
    return float(np.sort(low)[-aim.top]) if len(low) >= aim.top else 0.0


def settled(results: Results, aim: Aim) -> bool:
    """Whether as many combinations as are asked for have all of their runs."""
    return bool(results.whole.sum() >= aim.top)


def possible(results: Results, aim: Aim) -> np.ndarray:
    """Which combinations are taken to be able to be among the best (combinations,)."""
    reach, (low, high) = bar(results, aim), results.bounds()
    beaten = capital(results.hopeful, results.seen, reach * results.seen.shape[1]) >= aim.level
    able: np.ndarray = (high >= reach - _SLACK) & (~beaten | (low >= reach - _SLACK))
    return able


def next_runs(results: Results, aim: Aim) -> list[tuple[int, int]]:
    """Combination and seed, by their numbers from 0, of the runs to do next; none when the best are known.

    Those that promise most come first. Once as many as ``top`` are whole, each is advanced by as many seeds as it takes
    to exclude it if all of them fail.
    """
    seen, done = results.seen, results.seen.sum(axis=1)
    left, enough = np.nonzero(possible(results, aim) & ~results.whole)[0], settled(results, aim)
    order = left[np.lexsort((left, -done[left], -_promise(results)[left]))]
    width = max(round(_WIDTH * aim.top), len(left) // _SHARE if enough else 0) if done.any() else len(left)
    chosen = order[:width]
    begun = np.full(len(chosen), max(1, seen.shape[1] // _FIRST))
    steps = _until_excluded(results, aim, chosen) if enough else begun
    runs = [
        (combination, int(seed))
        for combination, step in zip(chosen.tolist(), steps.tolist(), strict=True)
        for seed in np.nonzero(~seen[combination])[0][:step]
    ]
    return sorted(runs, key=lambda run: (run[1], run[0]))


def _promise(results: Results) -> np.ndarray:
    """Total that each combination is expected to reach, and one standard deviation of it (combinations,)."""
    done, got = results.seen.sum(axis=1), results.hopeful.sum(axis=1)
    left = results.seen.shape[1] - done
    mean = (got + _PRIOR * (got.sum() + 0.5) / (done.sum() + 1.0)) / (done + _PRIOR)
    spread: np.ndarray = np.sqrt(left * mean * (1.0 - mean) * (1.0 + left / (done + _PRIOR)))
    return np.asarray(np.round(got + left * mean + spread, 9))  # equals stay equal whatever the processor


def _until_excluded(results: Results, aim: Aim, chosen: np.ndarray) -> np.ndarray:
    """How many seeds, all failing, exclude each of ``chosen``; all of its seeds if that many do not."""
    seen, total = results.seen[chosen], bar(results, aim) * results.seen.shape[1]
    failing = course(results.hopeful[chosen], np.ones_like(seen), total)
    out = (failing >= aim.level) & ~seen
    last = np.where(out.any(axis=1), out.argmax(axis=1), seen.shape[1] - 1)
    more: np.ndarray = np.maximum((~seen & (np.arange(seen.shape[1]) <= last[:, None])).sum(axis=1), 1)
    return more
