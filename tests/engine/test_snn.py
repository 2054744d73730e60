"""Networks: the sigmoid against torch, the kernel against its twin."""

import numba
import numpy as np
import pytest
import torch

from bns.engine import reference
from bns.engine.philox import Key
from bns.engine.snn import BLOCK, PREDICTION_BLOCK, hidden_count, initial_weights, predict, sigmoid, weight_count


@numba.njit(error_model="numpy")
def apply_sigmoid(x):
    out = np.empty_like(x)
    for i in range(x.size):
        out[i] = sigmoid(x[i])
    return out


def networks(hidden=20, count=3, scale=1.0, seed=0):
    return (initial_weights(Key(seed, 1), count, hidden) * scale).astype(np.float32)


def inputs(n, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (5, n)).astype(np.float32)


def test_sigmoid_is_torchs():
    x = np.concatenate([np.linspace(-40, 40, 400_001), [1e30, -1e30, np.inf, -np.inf, 0]]).astype(np.float32)
    ours = apply_sigmoid(x)
    np.testing.assert_allclose(ours, torch.sigmoid(torch.from_numpy(x)), rtol=0, atol=5e-7)
    assert apply_sigmoid(np.zeros(1, np.float32))[0] == 0.5


def test_sigmoid_lets_nan_through():
    assert np.isnan(apply_sigmoid(np.array([np.nan], np.float32))).all()


@pytest.mark.parametrize("hidden", [4, 20, 32])
@pytest.mark.parametrize("n", [1, 15, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK + 3])
def test_outputs_are_the_twins(hidden, n):
    weights, X = networks(hidden), inputs(n)
    # H outputs weighted with at most 1: each is good to 2e-7 (sigmoid) and a few roundings of 6e-8.
    np.testing.assert_allclose(predict(weights, X), reference.predict(weights, X), rtol=0, atol=hidden * 5e-7)


def test_a_last_input_that_is_0_at_first_counts_where_it_comes():
    """It is left out only where all of it is 0, however many patterns are handled at once."""
    weights, X = networks(), inputs(2 * PREDICTION_BLOCK + 3)
    X[4, :-2] = 0
    np.testing.assert_allclose(predict(weights, X), reference.predict(weights, X), rtol=0, atol=20 * 5e-7)


def test_saturated_networks_are_good_to_single_precision():
    weights, X = networks(scale=30.0), inputs(300)
    slow = reference.predict(weights, X)
    # An input sum of up to 180 is rounded to 1e-5, and the slope of a sigmoid is at most 1/4.
    np.testing.assert_allclose(predict(weights, X), slow, rtol=0, atol=20 * 30 * 1e-5)
    assert np.abs(slow).max() > 10


def test_an_output_does_not_depend_on_what_else_is_asked():
    weights, X = networks(), inputs(700)
    together = predict(weights, X)
    np.testing.assert_array_equal(predict(weights[1:2], X)[0], together[1])
    alone = predict(weights, np.ascontiguousarray(X[:, 600:601]))[:, 0]
    # A lone pattern takes the loop's remainder, where sums may be ordered otherwise.
    np.testing.assert_allclose(alone, together[:, 600], rtol=0, atol=2e-6)


def test_inputs_of_any_layout_and_type_are_taken():
    weights, X = networks(), inputs(40)
    np.testing.assert_array_equal(predict(weights, np.asfortranarray(X)), predict(weights, X))
    np.testing.assert_array_equal(predict(weights, X.astype(np.float64)), predict(weights, X))


def test_no_patterns_no_outputs():
    assert predict(networks(), np.empty((5, 0), np.float32)).shape == (3, 0)


def test_counts_of_weights_and_neurons_are_inverse():
    assert weight_count(20) == 5 * 20 + 20 + 20 + 1
    for hidden in range(4, 200, 4):
        assert hidden_count(weight_count(hidden)) == hidden


def test_untrained_weights_are_uniform_and_of_their_seed():
    weights = initial_weights(Key(5, 1), 30, 20)
    assert weights.dtype == np.float32
    assert np.abs(weights).max() <= 1
    counts = np.histogram(weights, 10, (-1, 1))[0]
    expected = weights.size / 10
    assert ((counts - expected) ** 2 / expected).sum() < 27.9  # 9 degrees of freedom, one in a thousand
    np.testing.assert_array_equal(weights[:3], initial_weights(Key(5, 1), 3, 20))
    assert len(np.unique(weights)) > 0.999 * weights.size
    assert not np.isin(initial_weights(Key(6, 1), 30, 20), weights).mean() > 0.01
