"""Training: the gradient against torch, the updates against their twins and torch's Rprop."""

import numpy as np
import pytest
import torch

from bns.engine import reference
from bns.engine.philox import Key
from bns.engine.rprop import Rprop, gradient
from bns.engine.snn import BLOCK, initial_weights, predict

ALGORITHMS = tuple(reference.UPDATES)


@pytest.fixture(autouse=True)
def _one_thread():
    """Networks this small only lose by torch's threads, the more so where tests run side by side."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def problem(n=150, hidden=20, seed=0):
    """Three untrained networks, inputs (5, n) and smooth targets (3, n)."""
    X = np.random.default_rng(seed).uniform(-1, 1, (5, n)).astype(np.float32)
    targets = np.stack([np.sin(2 * X[0]) * X[4], X[1] * X[2] + 0.2 * X[3], np.tanh(2 * X[0] - X[3])])
    return initial_weights(Key(seed, 5), 3, hidden), X, targets.astype(np.float32)


class Network(torch.nn.Module):
    """One of our networks over a single parameter, in our order of weights."""

    def __init__(self, row):
        super().__init__()
        self.row = torch.nn.Parameter(torch.as_tensor(row))

    def forward(self, X):
        neurons = self.row[:-1].reshape(-1, 7)
        hidden = torch.sigmoid(neurons[:, :5] @ X + neurons[:, 5:6])
        return neurons[:, 6] @ hidden + self.row[-1]

    def half_squared_error(self, X, target):
        return 0.5 * ((self(X) - target) ** 2).sum()


def mse(weights, X, targets):
    return float(np.mean((predict(weights, X) - targets) ** 2))


@pytest.mark.parametrize("n", [1, 7, 400, BLOCK + 1, 3 * BLOCK])
def test_twin_gradient_is_autograds(n):
    weights, X, targets = problem(n)
    net = Network(weights[1].astype(np.float64))
    net.half_squared_error(
        torch.as_tensor(X.astype(np.float64)), torch.as_tensor(targets[1].astype(np.float64))
    ).backward()
    np.testing.assert_allclose(reference.gradient(weights[1], X, targets[1]), net.row.grad, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("hidden", [4, 20])
@pytest.mark.parametrize("n", [1, 7, 400, BLOCK, BLOCK + 1, 3 * BLOCK + 5])
def test_gradient_is_its_twins(n, hidden):
    weights, X, targets = problem(n, hidden)
    for row, target in zip(weights, targets, strict=True):
        slow = reference.gradient(row, X, target)
        # n terms of order one, each good to about 1e-6 (sigmoid and rounding), whose errors mostly do not add up.
        np.testing.assert_allclose(gradient(row, X, target), slow, rtol=1e-5, atol=1e-6 * (10 + n / 4))


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_one_iteration_is_the_twins_update_on_the_same_gradient(algorithm):
    weights, X, targets = problem()
    rule, twin = Rprop.start(weights, algorithm), [reference.RpropState.start(row) for row in weights]
    turned = 0
    for _ in range(60):
        for net, state in enumerate(twin):
            slope = gradient(state.weights, X, targets[net])
            turned += int((slope * state.last_gradient < 0).sum())
            reference.UPDATES[algorithm](state, slope)
        rule.train(X, targets, X.shape[1], 1)
        np.testing.assert_array_equal(rule.weights, [state.weights for state in twin])
        np.testing.assert_array_equal(rule.step, [state.step for state in twin])
        np.testing.assert_array_equal(rule.last_gradient, [state.last_gradient for state in twin])
    assert turned > 1000  # both branches were taken, many times


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_training_follows_the_double_precision_twin(algorithm):
    weights, X, targets = problem()
    rule = Rprop.start(weights, algorithm)
    twin = [reference.RpropState.start(row.astype(np.float64)) for row in weights]
    for _ in range(4):
        rule.train(X, targets, X.shape[1], 10)
        for net, state in enumerate(twin):
            reference.train(state, X, targets[net], 10, algorithm)
        # Steps grow from 0.1 by 1.2 at most: no gradient near zero has changed its sign by rounding so far.
        np.testing.assert_allclose(rule.weights, [state.weights for state in twin], rtol=0, atol=2e-4)
    rule.train(X, targets, X.shape[1], 360)
    for net, state in enumerate(twin):
        reference.train(state, X, targets[net], 360, algorithm)
    slow = reference.predict(np.stack([state.weights for state in twin]), X)
    ours, theirs = mse(rule.weights, X, targets), float(np.mean((slow - targets) ** 2))
    assert theirs / 2 < ours < theirs * 2
    assert ours < mse(weights, X, targets) / 100


@pytest.mark.slow
def test_irprop_minus_is_torchs_rprop():
    weights, X, targets = problem()
    rule, net = Rprop.start(weights[:1], "irprop-"), Network(weights[0].copy())
    optimiser = torch.optim.Rprop([net.row], lr=0.1, etas=(0.5, 1.2), step_sizes=(1e-6, 50))
    inputs, target = torch.as_tensor(X), torch.as_tensor(targets[0])

    def both(iterations):
        rule.train(X, targets[:1], X.shape[1], iterations)
        for _ in range(iterations):
            optimiser.zero_grad()
            net.half_squared_error(inputs, target).backward()
            optimiser.step()

    for _ in range(30):
        both(1)
        # The same steps, to rounding: 141 weights of order one that have moved up to 30 times.
        np.testing.assert_allclose(rule.weights[0], net.row.detach(), rtol=0, atol=1e-5)
    both(970)
    ours, theirs = mse(rule.weights, X, targets[:1]), mse(net.row.detach().numpy()[None], X, targets[:1])
    assert theirs / 2 < ours < theirs * 2


def test_the_two_algorithms_part():
    weights, X, targets = problem()
    plus, minus = (Rprop.start(weights, algorithm) for algorithm in ALGORITHMS)
    for rule in (plus, minus):
        rule.train(X, targets, X.shape[1], 10)
    assert not np.array_equal(plus.weights, minus.weights)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_pauses_change_nothing(algorithm):
    weights, X, targets = problem()
    whole, parts = Rprop.start(weights, algorithm), Rprop.start(weights, algorithm)
    whole.train(X, targets, X.shape[1], 50)
    for iterations in (20, 0, 1, 29):
        parts.train(X, targets, X.shape[1], iterations)
    np.testing.assert_array_equal(whole.weights, parts.weights)


def test_only_patterns_in_use_count():
    weights, X, targets = problem(100)
    part, all_of_it = Rprop.start(weights, "rprop+"), Rprop.start(weights, "rprop+")
    part.train(X, targets, 40, 20)
    all_of_it.train(np.ascontiguousarray(X[:, :40]), np.ascontiguousarray(targets[:, :40]), 40, 20)
    np.testing.assert_array_equal(part.weights, all_of_it.weights)


def test_each_network_learns_its_own_target_only():
    weights, X, targets = problem()
    other = targets.copy()
    other[1] += 1
    one, two = Rprop.start(weights, "rprop+"), Rprop.start(weights, "rprop+")
    one.train(X, targets, X.shape[1], 20)
    two.train(X, other, X.shape[1], 20)
    np.testing.assert_array_equal(one.weights[[0, 2]], two.weights[[0, 2]])
    assert not np.array_equal(one.weights[1], two.weights[1])


def test_nothing_to_learn_or_no_time_leaves_the_weights():
    weights, X, targets = problem()
    rule = Rprop.start(weights, "rprop+")
    rule.train(X, targets, 0, 50)
    rule.train(X, targets, X.shape[1], 0)
    np.testing.assert_array_equal(rule.weights, weights)
    rule.train(X, targets, X.shape[1], 1)
    assert not np.array_equal(rule.weights, weights)


def test_steps_stay_within_their_bounds():
    weights, X, _ = problem(20)
    rule = Rprop.start(weights, "rprop+")
    rule.train(X, np.full((3, 20), 1e6, np.float32), 20, 100)
    assert rule.step.max() == 50
    weights, X, targets = problem(20)
    rule = Rprop.start(weights, "rprop+")
    rule.train(X, targets, 20, 3000)
    assert rule.step.min() == np.float32(1e-6)


def test_a_restarted_network_begins_as_at_first():
    weights, X, targets = problem()
    rule, fresh = Rprop.start(weights, "rprop+"), Rprop.start(weights, "rprop+")
    rule.train(X, targets, X.shape[1], 30)
    for net in range(3):
        rule.restart(net, weights[net])
    rule.train(X, targets, X.shape[1], 30)
    fresh.train(X, targets, X.shape[1], 30)
    np.testing.assert_array_equal(rule.weights, fresh.weights)
