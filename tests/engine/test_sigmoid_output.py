"""Networks of four inputs with a sigmoid output, and patterns that stand for several, against their twins."""

import numpy as np
import pytest

from bns.engine import reference
from bns.engine.patterns import PatternSet
from bns.engine.philox import Key
from bns.engine.rprop import Rprop, gradient
from bns.engine.snn import PER_NEURON, initial_weights, predict


def problem(n=300, hidden=100):
    X = np.random.default_rng(0).uniform(-1, 1, (5, n)).astype(np.float32)
    X[4] = 0
    target = (0.5 + 0.4 * np.sin(2 * X[0]) * X[1]).astype(np.float32)
    return initial_weights(Key(1, 1), 2, hidden, 4), X, target


def test_outputs_are_their_twins_and_lie_between_0_and_1():
    weights, X, _ = problem()
    outputs = predict(weights, X, True)
    np.testing.assert_allclose(outputs, reference.predict(weights, X, True), atol=2e-5)
    assert ((outputs >= 0) & (outputs <= 1)).all()
    np.testing.assert_allclose(outputs, 1 / (1 + np.exp(-predict(weights, X).astype(np.float64))), atol=1e-6)


@pytest.mark.parametrize("squashed", [False, True])
@pytest.mark.parametrize("n", [3, 300, 1300])
def test_gradient_is_its_twins_with_counts_and_without(n, squashed):
    weights, X, target = problem(n)
    counts = np.random.default_rng(1).integers(1, 5, n).astype(np.float32)
    for given in (None, counts):
        slow = reference.gradient(weights[0], X, target, given, squashed)
        fast = gradient(weights[0], X, target, given, squashed)
        np.testing.assert_allclose(fast, slow, rtol=1e-4, atol=3e-6 * (10 + n))


@pytest.mark.parametrize("n", [3, 1300])
def test_gradient_with_a_flat_spot_is_its_twins_and_keeps_a_saturated_output_learning(n):
    weights, X, target = problem(n)
    counts = np.random.default_rng(1).integers(1, 5, n).astype(np.float32)
    slow = reference.gradient(weights[0], X, target, counts, True, 0.1)
    fast = gradient(weights[0], X, target, counts, True, 0.1)
    np.testing.assert_allclose(fast, slow, rtol=1e-4, atol=3e-6 * (10 + n))
    saturated = np.abs(weights[0])
    assert np.abs(gradient(saturated, X, target, None, True)[-1]) < 1e-3 * n
    assert np.abs(gradient(saturated, X, target, None, True, 0.1)[-1]) > 0.02 * n


def test_twin_gradient_is_the_slope_of_the_error():
    weights, X, target = problem(20, 4)
    row, counts = weights[0].astype(np.float64), np.arange(20) % 3

    def error(row):
        return 0.5 * (counts * (reference.predict(row[None], X, True)[0] - target) ** 2).sum()

    slope = [(error(row + 1e-6 * unit) - error(row - 1e-6 * unit)) / 2e-6 for unit in np.eye(row.size)]
    np.testing.assert_allclose(reference.gradient(row, X, target, counts, True), slope, atol=1e-8)


def test_a_pattern_that_counts_twice_is_two_patterns():
    weights, X, target = problem(50)
    twice = gradient(weights[0], np.hstack([X, X]), np.hstack([target, target]), None, True)
    np.testing.assert_allclose(gradient(weights[0], X, target, np.full(50, 2, np.float32), True), twice, rtol=1e-4, atol=1e-5)


def test_absent_inputs_keep_weights_of_zero_through_training():
    weights, X, target = problem()
    rule = Rprop.start(weights, "rprop+", sigmoid_output=True)
    before = float(np.mean((predict(rule.weights, X, True) - target) ** 2))
    rule.train(X, np.vstack([target, target]), X.shape[1], 200)
    assert (rule.weights[:, 4:-1:PER_NEURON] == 0).all()
    assert float(np.mean((predict(rule.weights, X, True) - target) ** 2)) < before / 20


def test_merged_patterns_have_the_gradient_of_all_of_them():
    weights, X, target = problem(40)
    random = np.random.default_rng(2)
    again = random.integers(0, 40, 100)
    noisy = (target[again] + random.normal(0, 0.1, 100)).astype(np.float32)
    present = np.vstack([random.random(100) < 0.5, np.ones(100, bool)])
    patterns = PatternSet.empty(5, 2)
    patterns.add(X[:, again], np.vstack([noisy, noisy]), present)
    for net, (inputs, means, counts) in enumerate(patterns.merged()):
        chosen = present[net]
        assert counts.sum() == chosen.sum()
        assert inputs.shape[1] == len(np.unique(again[chosen]))
        whole = gradient(weights[net], np.ascontiguousarray(X[:, again[chosen]]), noisy[chosen], None, True)
        np.testing.assert_allclose(gradient(weights[net], inputs, means, counts, True), whole, rtol=1e-3, atol=1e-4)


def test_a_network_that_may_learn_nothing_has_no_patterns():
    patterns = PatternSet.empty(5, 2)
    patterns.add(np.ones((5, 3), np.float32), np.ones((2, 3), np.float32), np.array([[False] * 3, [True] * 3]))
    (inputs, means, counts), (_, other, _) = patterns.merged()
    assert (inputs.shape, len(means), len(counts), len(other)) == ((5, 0), 0, 0, 1)
    assert [len(counts) for _, _, counts in PatternSet.empty(5, 2).merged()] == [0, 0]
