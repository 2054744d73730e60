"""One launch of the training kernel against the same iterations of the CPU engine."""

import numpy as np
import pytest

from bns.cuda.on_device.training import WARP, layout_of, restart, training_kernel
from bns.cuda.settings import SETTINGS
from bns.engine.philox import Key
from bns.engine.rprop import INITIAL_STEP, Rprop
from bns.engine.snn import initial_weights


def problem(n, hidden=20, networks=1, seed=0):
    draws = np.random.default_rng(seed)
    X = draws.uniform(-1, 1, (5, n)).astype(np.float32)
    targets = np.stack([np.sin((2 + k) * X[0]) * X[4] + X[1] for k in range(networks)]).astype(np.float32)
    return initial_weights(Key(seed, 5), networks, hidden), X, targets


def settings(**values):
    one = np.zeros(1, SETTINGS)
    for name, value in ({"evaluations": 1, "backtrack": 1} | values).items():
        one[name] = value
    return one


def trained(rule, X, targets, iterations, backtrack=True, evaluation=1, times=None):
    """Weights, step, last_gradient, last_change (1, networks, W) after a launch."""
    state = [np.array(part)[None] for part in (rule.weights, rule.step, rule.last_gradient, rule.last_change)]
    training_kernel((rule.weights.shape[1] - 1) // 7, rule.sigmoid_output, times is not None)[(1, len(targets)), WARP](
        evaluation, settings(iterations=iterations, backtrack=backtrack), *state, X[None], targets[None],
        np.zeros((1, 1, 1), np.float32) if times is None else times[None], np.array([X.shape[1]], np.int32),
    )  # fmt: skip
    return [part[0] for part in state]


@pytest.mark.parametrize("n", [1, 7, 8, 19])
def test_gradient_of_an_iteration_is_the_cpu_engines(n):
    weights, X, targets = problem(n)
    rule = Rprop.start(weights, "rprop+")
    _, _, gradient, _ = trained(rule, X, targets, 1)
    rule.train(X, targets, n, 1)
    # Sums of n terms of order one in another order, each good to about 1e-6.
    np.testing.assert_allclose(gradient, rule.last_gradient, rtol=1e-4, atol=3e-6 * n)


@pytest.mark.parametrize("algorithm", ["rprop+", "irprop-"])
def test_some_iterations_end_where_the_cpu_engine_ends(algorithm):
    weights, X, targets = problem(9, networks=2)
    rule = Rprop.start(weights, algorithm)
    got = trained(rule, X, targets, 6, algorithm == "rprop+")
    rule.train(X, targets, 9, 6)
    assert (rule.step < INITIAL_STEP).any()  # a gradient has turned, so both branches of the rule were taken
    np.testing.assert_allclose(got[0], rule.weights, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(got[1], rule.step, rtol=1e-5)
    np.testing.assert_allclose(got[3], rule.last_change, rtol=1e-5)


@pytest.mark.parametrize("hidden", [4, 12])
def test_neurons_that_do_not_fill_the_lanes(hidden):
    weights, X, targets = problem(5, hidden)
    rule = Rprop.start(weights, "rprop+")
    got = trained(rule, X, targets, 2)
    rule.train(X, targets, 5, 2)
    np.testing.assert_allclose(got[0], rule.weights, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize(("hidden", "n"), [(12, 5), (100, 3)])
def test_networks_with_sigmoid_outputs_learn_from_patterns_that_stand_for_several(hidden, n):
    weights, X, targets = problem(n, hidden, networks=2)
    targets, times = 0.5 + targets / 5, np.random.default_rng(1).integers(1, 6, targets.shape).astype(np.float32)
    times[1, 1] = 0  # one that this network does not learn from
    rule = Rprop.start(weights, "rprop+", sigmoid_output=True)
    got = trained(rule, X, targets, 2, times=times)
    for net in range(2):
        rule.train_one(net, X, targets[net], times[net], n, 2)
    np.testing.assert_allclose(got[2], rule.last_gradient, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(got[0], rule.weights, rtol=1e-5, atol=1e-5)


def test_a_network_takes_the_places_that_leave_the_fewest_empty():
    sizes = (4, 8, 12, 20, 24, 100, 160)
    assert [layout_of(hidden) for hidden in sizes] == [(4, 1), (4, 2), (4, 4), (5, 4), (4, 8), (4, 32), (5, 32)]
    with pytest.raises(ValueError, match="164 hidden neurons; a warp holds 160"):
        layout_of(164)


def test_a_run_that_has_ended_is_left_alone():
    weights, X, targets = problem(3)
    rule = Rprop.start(weights, "rprop+")
    np.testing.assert_array_equal(trained(rule, X, targets, 2, evaluation=2)[0], rule.weights)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_network_that_is_no_longer_finite_begins_anew_and_the_others_do_not(value):
    untrained = problem(1, networks=2)[0][None]
    state = [untrained + 1, *(np.full_like(untrained, 7.0) for _ in range(3))]
    state[0][0, 1, 5] = value
    failures = np.zeros(1, np.int32)
    restart[1, 3](1, settings(), untrained, *state, failures)
    np.testing.assert_array_equal(state[0][0, 1], untrained[0, 1])
    np.testing.assert_array_equal(state[0][0, 0], untrained[0, 0] + 1)
    assert [part[0, 1, 0] for part in state[1:]] == [np.float32(INITIAL_STEP), 0, 0]
    assert {part[0, 0, 0] for part in state[1:]} == {7}
    assert failures.tolist() == [1]
