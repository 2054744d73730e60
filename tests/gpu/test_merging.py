"""Patterns of the same inputs taken together, as they come, against the CPU engine's of all at once."""

import numpy as np

from bns.cuda.on_device.merging import merge
from bns.cuda.settings import SETTINGS
from bns.engine.patterns import PatternSet


def test_patterns_of_the_same_inputs_are_one_whenever_they_come():
    draws = np.random.default_rng(3)
    some = draws.uniform(-1, 1, (5, 4)).astype(np.float32)
    X = some[:, [0, 0, 1, 2, 1, 0, 3, 1, 3]]
    targets = draws.uniform(0, 1, (2, X.shape[1])).astype(np.float32)
    targets[0, [3, 5]] = np.nan  # one input that the first network never learns from, and one that it sometimes does
    settings, merged, distinct = np.zeros(1, SETTINGS), np.zeros(1, np.int32), np.zeros(1, np.int32)
    settings["evaluations"] = 9
    inputs, sums = np.full((1, 5, 9), np.nan, np.float32), np.full((1, 2, 9), np.nan)
    means, times = np.full((2, 1, 2, 9), np.nan, np.float32)  # what was there before is of no account
    for evaluation, count in enumerate([4, 4, 8, 9], 1):
        merge[1, 3](
            evaluation, settings, X[None], targets[None], np.array([count], np.int32), merged, inputs, sums, means, times,
            distinct,
        )  # fmt: skip
    assert (merged.tolist(), distinct.tolist()) == ([9], [4])
    there = PatternSet.empty(5, 2)
    there.add(X, np.nan_to_num(targets), np.isfinite(targets))
    for net, (columns, mean, count) in enumerate(there.merged()):
        learned = times[0, net, :4] > 0
        here = np.vstack([inputs[0, :, :4], means[0, net, :4], times[0, net, :4]])[:, learned]
        wanted = np.vstack([columns, mean, count])
        np.testing.assert_array_equal(here[:, np.argsort(here[0])], wanted[:, np.argsort(wanted[0])])
