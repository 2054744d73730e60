"""Simulator neural networks as flat arrays of weights, and the kernel that reads them.

A network has 5 inputs, H sigmoid hidden neurons and one output, linear (figure 4.3) or a sigmoid itself (figure 5.6). Its
weights are one float32 row: for each hidden neuron the five input weights, its bias and its weight to the output, and at the
end the output's bias. Of a network with fewer inputs the others are 0, and so are their weights: training leaves them there.
H is a multiple of four, because the kernels take four hidden neurons at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bns.engine.jit import exact, fast, inline, larger, smaller
from bns.engine.philox import Key, Purpose, uniforms

INPUTS = 5
PER_NEURON = INPUTS + 2
GROUP = 4
BLOCK = 512
"""Patterns handled at once, so that the hidden activations stay in the first-level cache."""
PREDICTION_BLOCK = 1024

_F = np.float32
SATURATED = _F(15.4)
"""Where the sigmoid ends to change."""
NUMERATOR = (_F(-6.237572861e-12), _F(2.846224625e-08), _F(4.236714370e-05), _F(7.953990022e-03), _F(2.499998301e-01))
DENOMINATOR = (_F(3.105721397e-06), _F(1.432030337e-03), _F(1.151486597e-01), _F(1.0))
"""Coefficients of its polynomials in the square, the highest power first."""
HALF = _F(0.5)


def weight_count(hidden: int) -> int:
    """Length of a network's row of weights."""
    return hidden * PER_NEURON + 1


def hidden_count(weights: int) -> int:
    """Hidden neurons of a network with so many weights."""
    return (weights - 1) // PER_NEURON


def initial_weights(
    key: Key, networks: int, hidden: int, inputs: int = INPUTS, nguyen_widrow: bool = False
) -> np.ndarray:
    """Untrained networks: uniform in [-1, 1], shape (networks, weights), float32; 0 for inputs that are not there.

    ``nguyen_widrow``: in the ranges that Encog 3.2, the original's library, draws networks of sigmoids alone from: with
    b = 0.7 n^(1/m) for n neurons of m inputs each, biases in [-b, b] and weights in [0, b].
    """
    count = weight_count(hidden)
    draws = uniforms(key, Purpose.WEIGHTS, 0, networks, -(-count // 4)).reshape(networks, -1)
    low, high = _nguyen_widrow(hidden, inputs) if nguyen_widrow else (-np.ones(count), np.ones(count))
    weights = (low + (high - low) * draws[:, :count]).astype(np.float32)
    for absent in range(inputs, INPUTS):
        weights[:, absent:-1:PER_NEURON] = 0
    return weights


def _nguyen_widrow(hidden: int, inputs: int) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest value of every weight of a network."""
    to_hidden, to_output = 0.7 * hidden ** (1 / inputs), 0.7
    low, high = np.zeros((hidden, PER_NEURON)), np.full((hidden, PER_NEURON), to_hidden)
    low[:, INPUTS], high[:, INPUTS + 1] = -to_hidden, to_output
    return np.append(low.ravel(), -to_output), np.append(high.ravel(), to_output)


def side_by_side(parts: Sequence[np.ndarray], share: float = 1.0) -> np.ndarray:
    """Networks (networks, W) whose outputs, before any sigmoid, are ``share`` times the sum of those of all parts.

    Hidden neurons of all parts stand side by side: the sum of networks is a wider network, so that kernels need not know.
    """
    neurons = np.concatenate([part[:, :-1].reshape(len(part), -1, PER_NEURON) for part in parts], axis=1)
    neurons[:, :, -1] *= np.float32(share)
    bias = np.float32(share) * np.sum([part[:, -1:] for part in parts], axis=0, dtype=np.float32)
    return np.ascontiguousarray(np.hstack([neurons.reshape(len(neurons), -1), bias]), np.float32)


@inline
def sigmoid(x: Any) -> Any:
    """Logistic function to 3e-7, without a branch and without exp, so that it vectorises.

    1/2 + x P(x²)/Q(x²), degree 9 over 6, fitted for the smallest largest error (7e-8) on |x| <= 15.4, where it saturates.
    """
    x = larger(-SATURATED, smaller(SATURATED, x))  # type: ignore[call-arg]  # mypy sees the typing context
    s = x * x
    p = NUMERATOR[0] * s + NUMERATOR[1]
    p = p * s + NUMERATOR[2]
    p = p * s + NUMERATOR[3]
    p = p * s + NUMERATOR[4]
    q = DENOMINATOR[0] * s + DENOMINATOR[1]
    q = q * s + DENOMINATOR[2]
    q = q * s + DENOMINATOR[3]
    return HALF + x * p / q


@inline
def neuron(w: Any, k: Any) -> Any:
    """Weights of the hidden neuron that begins at k, as a tuple: they stay in registers."""
    return w[k], w[k + 1], w[k + 2], w[k + 3], w[k + 4], w[k + 5], w[k + 6]


@inline
def activation(n: Any, x0: Any, x1: Any, x2: Any, x3: Any, x4: Any) -> Any:
    """Output of a hidden neuron."""
    return sigmoid(n[5] + n[0] * x0 + n[1] * x1 + n[2] * x2 + n[3] * x3 + n[4] * x4)


@inline
def activation_of_four(n: Any, x0: Any, x1: Any, x2: Any, x3: Any) -> Any:
    """As `activation`, where the last input is 0."""
    return sigmoid(n[5] + n[0] * x0 + n[1] * x1 + n[2] * x2 + n[3] * x3)


@exact
def last_input_is_absent(X, n):  # type: ignore[no-untyped-def]  # compiled
    """Whether the last input is 0 in the first n columns of X (5, >= n), as for networks that have four.

    It adds 0 to every sum and to every gradient then: kernels that leave it out give the same numbers in less time.
    """
    used = 0
    for p in range(n):
        used += X[INPUTS - 1, p] != 0
    return used == 0


@inline
def four_neurons(w: Any, first: Any) -> Any:
    """Weights of four hidden neurons from the first on."""
    k = first * PER_NEURON
    return neuron(w, k), neuron(w, k + PER_NEURON), neuron(w, k + 2 * PER_NEURON), neuron(w, k + 3 * PER_NEURON)


@fast
def _forward4(X, w, first, hidden_out, out, a, b):  # type: ignore[no-untyped-def]  # compiled
    x0, x1, x2, x3, x4 = X[0, a:b], X[1, a:b], X[2, a:b], X[3, a:b], X[4, a:b]
    h0, h1 = hidden_out[first, : b - a], hidden_out[first + 1, : b - a]
    h2, h3 = hidden_out[first + 2, : b - a], hidden_out[first + 3, : b - a]
    n0, n1, n2, n3 = four_neurons(w, first)
    for p in range(out.size):
        v0, v1, v2, v3, v4 = x0[p], x1[p], x2[p], x3[p], x4[p]
        s0 = activation(n0, v0, v1, v2, v3, v4)
        s1 = activation(n1, v0, v1, v2, v3, v4)
        s2 = activation(n2, v0, v1, v2, v3, v4)
        s3 = activation(n3, v0, v1, v2, v3, v4)
        h0[p] = s0
        h1[p] = s1
        h2[p] = s2
        h3[p] = s3
        out[p] += n0[6] * s0 + n1[6] * s1 + n2[6] * s2 + n3[6] * s3


@fast
def _forward4_of_four(X, w, first, hidden_out, out, a, b):  # type: ignore[no-untyped-def]  # compiled
    """As `_forward4`, where the last input is 0."""
    x0, x1, x2, x3 = X[0, a:b], X[1, a:b], X[2, a:b], X[3, a:b]
    h0, h1 = hidden_out[first, : b - a], hidden_out[first + 1, : b - a]
    h2, h3 = hidden_out[first + 2, : b - a], hidden_out[first + 3, : b - a]
    n0, n1, n2, n3 = four_neurons(w, first)
    for p in range(out.size):
        v0, v1, v2, v3 = x0[p], x1[p], x2[p], x3[p]
        s0 = activation_of_four(n0, v0, v1, v2, v3)
        s1 = activation_of_four(n1, v0, v1, v2, v3)
        s2 = activation_of_four(n2, v0, v1, v2, v3)
        s3 = activation_of_four(n3, v0, v1, v2, v3)
        h0[p] = s0
        h1[p] = s1
        h2[p] = s2
        h3[p] = s3
        out[p] += n0[6] * s0 + n1[6] * s1 + n2[6] * s2 + n3[6] * s3


@fast
def forward(X, w, hidden_out, out, a, b, absent):  # type: ignore[no-untyped-def]  # compiled
    """Add all hidden neurons' share to the output of patterns a..b; keep their activations in hidden_out (hidden, >= b - a)."""
    for first in range(0, (w.size - 1) // PER_NEURON, GROUP):
        if absent:
            _forward4_of_four(X, w, first, hidden_out, out, a, b)
        else:
            _forward4(X, w, first, hidden_out, out, a, b)


@fast
def _add4(X, w, first, out, a, b):  # type: ignore[no-untyped-def]  # compiled
    """As `_forward4`, for predictions: the activations are not kept."""
    x0, x1, x2, x3, x4 = X[0, a:b], X[1, a:b], X[2, a:b], X[3, a:b], X[4, a:b]
    n0, n1, n2, n3 = four_neurons(w, first)
    for p in range(out.size):
        v0, v1, v2, v3, v4 = x0[p], x1[p], x2[p], x3[p], x4[p]
        low = n0[6] * activation(n0, v0, v1, v2, v3, v4) + n1[6] * activation(n1, v0, v1, v2, v3, v4)
        high = n2[6] * activation(n2, v0, v1, v2, v3, v4) + n3[6] * activation(n3, v0, v1, v2, v3, v4)
        out[p] += low + high


@fast
def _add4_of_four(X, w, first, out, a, b):  # type: ignore[no-untyped-def]  # compiled
    """As `_add4`, where the last input is 0."""
    x0, x1, x2, x3 = X[0, a:b], X[1, a:b], X[2, a:b], X[3, a:b]
    n0, n1, n2, n3 = four_neurons(w, first)
    for p in range(out.size):
        v0, v1, v2, v3 = x0[p], x1[p], x2[p], x3[p]
        low = n0[6] * activation_of_four(n0, v0, v1, v2, v3) + n1[6] * activation_of_four(n1, v0, v1, v2, v3)
        high = n2[6] * activation_of_four(n2, v0, v1, v2, v3) + n3[6] * activation_of_four(n3, v0, v1, v2, v3)
        out[p] += low + high


@fast
def predict_into(weights, X, n, out):  # type: ignore[no-untyped-def]  # compiled
    """Outputs of several networks for the first n columns of X.

    weights (networks, W), X (5, >= n), out (networks, >= n): float32.
    """
    hidden, absent = (weights.shape[1] - 1) // PER_NEURON, last_input_is_absent(X, n)
    for a in range(0, n, PREDICTION_BLOCK):
        b = min(a + PREDICTION_BLOCK, n)
        for net in range(weights.shape[0]):
            w, o = weights[net], out[net, a:b]
            o[:] = w[w.size - 1]
            for first in range(0, hidden, GROUP):
                if absent:
                    _add4_of_four(X, w, first, o, a, b)
                else:
                    _add4(X, w, first, o, a, b)


@fast
def _squash(row):  # type: ignore[no-untyped-def]  # compiled
    for p in range(row.size):
        row[p] = sigmoid(row[p])


@fast
def squash_into(out, n):  # type: ignore[no-untyped-def]  # compiled
    """Sigmoid outputs in place of linear ones, in the first n columns of out (networks, >= n)."""
    for net in range(out.shape[0]):
        _squash(out[net, :n])


def predict(weights: np.ndarray, X: np.ndarray, sigmoid_output: bool = False) -> np.ndarray:
    """Outputs (networks, n) of networks (networks, W) for inputs X (5, n); all float32."""
    n = X.shape[1]
    out = np.empty((weights.shape[0], n), np.float32)
    predict_into(weights, np.ascontiguousarray(X, np.float32), n, out)
    if sigmoid_output:
        squash_into(out, n)
    return out
