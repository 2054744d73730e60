"""Forms of one kernel: four neurons or one at a time, five inputs or four. They must not differ by more than rounding."""

import numpy as np
import pytest

from bns.engine.backward import four_at_once, one_at_once
from bns.engine.jit import MANY_REGISTERS
from bns.engine.philox import Key
from bns.engine.snn import INPUTS, forward, initial_weights, last_input_is_absent, predict_into

HIDDEN = 20
SIZES = (1, 7, 8, 61, 400)


def patterns(n, inputs):
    """Inputs (5, n) of networks with so many, and errors (n,)."""
    draws = np.random.default_rng(n)
    X = draws.uniform(-1, 1, (INPUTS, n)).astype(np.float32)
    X[inputs:] = 0
    return X, draws.normal(size=n).astype(np.float32)


def gradients(way, X, error, absent, inputs):
    """Activations and gradient (W,) of one network."""
    n, weights = X.shape[1], initial_weights(Key(3, 1), 1, HIDDEN, inputs)[0]
    hidden_out, out, gradient = np.zeros((HIDDEN, n), np.float32), np.zeros(n, np.float32), np.zeros_like(weights)
    forward(X, weights, hidden_out, out, 0, n, absent)
    way(X, weights, hidden_out, error, gradient, 0, n, absent)
    return hidden_out, out, gradient


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("inputs", [4, 5])
def test_one_neuron_at_a_time_gives_what_four_give(n, inputs):
    X, error = patterns(n, inputs)
    (_, _, four), (_, _, one) = (gradients(way, X, error, inputs == 4, inputs) for way in (four_at_once, one_at_once))
    assert np.abs(four).max() > 0
    if MANY_REGISTERS:  # sums are in another order there, and only the first form is used
        np.testing.assert_allclose(one, four, rtol=1e-4, atol=1e-4)
    else:
        np.testing.assert_array_equal(one, four)


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("way", [four_at_once, one_at_once])
def test_an_input_that_is_absent_can_be_left_out_bit_for_bit(n, way):
    X, error = patterns(n, 4)
    for with_it, without in zip(
        gradients(way, X, error, False, 4), gradients(way, X, error, True, 4), strict=True
    ):  # fmt: skip
        np.testing.assert_array_equal(with_it, without)


def test_an_input_is_absent_only_where_it_is_0_in_every_pattern_in_use():
    X, _ = patterns(9, 4)
    assert last_input_is_absent(X, 9)
    X[4, 8] = 1e-30
    assert not last_input_is_absent(X, 9)
    assert last_input_is_absent(X, 8)
    X[4, 8] = np.nan
    assert not last_input_is_absent(X, 9)


def test_predictions_with_an_absent_input_are_those_with_it():
    weights, (X, _) = initial_weights(Key(1, 1), 3, HIDDEN, 4), patterns(100, 4)
    hardly = np.concatenate([X, np.eye(INPUTS, 1, -4, np.float32)], axis=1)  # one pattern more, with all five
    with_it, without = np.empty((3, 101), np.float32), np.empty((3, 101), np.float32)
    predict_into(weights, hardly, 101, with_it)
    predict_into(weights, X, 100, without)
    np.testing.assert_array_equal(with_it[:, :100], without[:, :100])
