"""Resilient backpropagation over all patterns at once (Riedmiller and Braun 1993), compiled.

Two variants: ``rprop+`` takes the last change back when a gradient changes sign (what the original's library does by
default), ``irprop-`` forgets the gradient instead (what torch.optim.Rprop does).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bns.engine import narrow, wide
from bns.engine.backward import share, write
from bns.engine.jit import MANY_REGISTERS, exact, fast, inline
from bns.engine.snn import BLOCK, PER_NEURON, last_input_is_absent, sigmoid

INITIAL_STEP, LARGEST_STEP, SMALLEST_STEP = 0.1, 50.0, 1e-6
GROW, SHRINK = 1.2, 0.5
_F = np.float32
_GROW, _SHRINK, _LARGEST, _SMALLEST, _ZERO = _F(GROW), _F(SHRINK), _F(LARGEST_STEP), _F(SMALLEST_STEP), _F(0)
_ALL_ALIKE = np.empty(0, np.float32)
_ways: Any = wide if MANY_REGISTERS else narrow
_prepared, _forward, _total, _backward = _ways.prepared, _ways.forward, _ways.total, _ways.backward


@dataclass
class Rprop:
    """Weights under training and what the rule remembers, each (networks, W) float32."""

    weights: np.ndarray
    step: np.ndarray
    last_gradient: np.ndarray
    last_change: np.ndarray
    backtrack: bool
    sigmoid_output: bool = False
    flat_spot: float = 0.0

    @classmethod
    def start(cls, weights: np.ndarray, algorithm: str, sigmoid_output: bool = False, flat_spot: float = 0.0) -> Rprop:
        """Begin with these networks; algorithm is ``rprop+`` or ``irprop-``; ``flat_spot`` is added to the slopes of sigmoids."""
        weights = weights.astype(np.float32)
        return cls(
            weights,
            np.full_like(weights, INITIAL_STEP),
            np.zeros_like(weights),
            np.zeros_like(weights),
            algorithm == "rprop+",
            sigmoid_output,
            flat_spot,
        )

    def train(self, X: np.ndarray, targets: np.ndarray, count: int, iterations: int) -> None:
        """Train every network on its row of targets (networks, >= count) for inputs X (5, >= count)."""
        for net in range(len(self.weights)):
            self.train_one(net, X, targets[net], _ALL_ALIKE, count, iterations)

    def train_one(
        self, net: int, X: np.ndarray, target: np.ndarray, counts: np.ndarray, count: int, iterations: int
    ) -> None:
        """Train one network; counts (>= count,) float32 says how often each pattern stands for one, empty: once."""
        if count == 0:
            return
        train_network(
            self.weights[net],
            self.step[net],
            self.last_gradient[net],
            self.last_change[net],
            X,
            target,
            counts,
            count,
            iterations,
            self.backtrack,
            self.sigmoid_output,
            np.float32(self.flat_spot),
        )

    def restart(self, net: int, weights: np.ndarray) -> None:
        """Begin one network anew, after its arithmetic has failed."""
        self.weights[net] = weights
        self.step[net] = INITIAL_STEP
        self.last_gradient[net] = 0
        self.last_change[net] = 0


@inline
def residual(out: Any, target: Any) -> Any:
    """Derivative of half the squared error by what goes into a linear output."""
    return out - target


@inline
def squashed_residual(out: Any, target: Any) -> Any:
    """As `residual`, through the slope of a sigmoid output."""
    y = sigmoid(out)
    return (y - target) * (y - y * y)


@fast
def _residuals(out, target, bias, error):  # type: ignore[no-untyped-def]  # compiled
    total = _ZERO
    for p in range(out.size):
        e = residual(out[p] + bias, target[p])
        error[p] = e
        total += e
    return total


@fast
def _squashed_residuals(out, target, bias, error):  # type: ignore[no-untyped-def]  # compiled
    total = _ZERO
    for p in range(out.size):
        e = squashed_residual(out[p] + bias, target[p])
        error[p] = e
        total += e
    return total


@fast
def _lifted_residuals(out, target, bias, error, flat):  # type: ignore[no-untyped-def]  # compiled
    """As `_squashed_residuals`, where the slope is never below ``flat``: a saturated output goes on learning."""
    total = _ZERO
    for p in range(out.size):
        y = sigmoid(out[p] + bias)
        e = (y - target[p]) * (y - y * y + flat)
        error[p] = e
        total += e
    return total


@fast
def _lift(X, w, error, gradient, flat, a, b):  # type: ignore[no-untyped-def]  # compiled
    """What ``flat`` on the slopes of the hidden neurons adds to their gradients: the same sums for all of them."""
    zero = _ZERO
    g = (zero, zero, zero, zero, zero, zero)
    for p in range(error.size):
        g = share(g, flat * error[p], X[0, a + p], X[1, a + p], X[2, a + p], X[3, a + p], X[4, a + p])
    for k in range(0, w.size - 1, PER_NEURON):
        write(gradient, w, k, g, zero)


@fast
def _counted(error, counts):  # type: ignore[no-untyped-def]  # compiled
    total = _ZERO
    for p in range(error.size):
        error[p] *= counts[p]
        total += error[p]
    return total


@fast
def _errors(out, target, counts, bias, squashed, flat, error):  # type: ignore[no-untyped-def]  # compiled
    """Derivative of half the squared error by what goes into the output, pattern by pattern, and its sum."""
    if squashed and flat > _ZERO:
        total = _lifted_residuals(out, target, bias, error, flat)
    else:
        total = _squashed_residuals(out, target, bias, error) if squashed else _residuals(out, target, bias, error)
    return _counted(error, counts) if counts.size > 0 else total


@exact
def _block(n):  # type: ignore[no-untyped-def]  # compiled
    """Patterns worked on at once: at most `BLOCK`, so many that all blocks are as long, but for the last."""
    return -(-n // -(-n // BLOCK))


@fast
def _gradient_into(w, X, inputs, target, counts, n, absent, gradient, hidden_out, out, error, squashed, flat):  # type: ignore[no-untyped-def]  # compiled
    """Gradient of half the summed squared error over patterns 0..n, into gradient (W,); absent: see `last_input_is_absent`.

    inputs: X as the ways forward and back take it; hidden_out (hidden, `BLOCK`), out and error (`BLOCK`,): room to work in.
    """
    gradient[:] = _ZERO
    block = _block(n)
    for a in range(0, n, block):
        b, number = min(a + block, n), a // block
        e = error[: b - a]
        _forward(inputs, number, w, hidden_out, out, a, b, absent)
        as_compiled = _errors(out[: b - a], target[a:b], counts[a:b], w[w.size - 1], squashed, flat, e)
        gradient[w.size - 1] += _total(e, as_compiled)
        _backward(inputs, number, w, hidden_out, error, gradient, a, b, absent)
        if flat > _ZERO:
            _lift(X, w, e, gradient, flat, a, b)


@exact
def gradient_into(w, X, target, counts, n, gradient, squashed, flat):  # type: ignore[no-untyped-def]  # compiled
    """Gradient of one network into gradient (W,); the other arguments as of `train_network`."""
    hidden_out = np.empty(((w.size - 1) // PER_NEURON, BLOCK), np.float32)
    out, error = np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    absent, inputs = last_input_is_absent(X, n), _prepared(X, n, _block(n))
    _gradient_into(w, X, inputs, target, counts, n, absent, gradient, hidden_out, out, error, squashed, flat)


@inline
def changed(g: Any, w: Any, step: Any, last_gradient: Any, last_change: Any, backtrack: Any) -> Any:
    """One weight after an iteration with gradient g: weight, step, gradient and change to be remembered."""
    agreement = g * last_gradient
    if agreement < _ZERO:
        step = max(step * _SHRINK, _SMALLEST)
        if backtrack:
            last_change = -last_change
            w += last_change
        last_gradient = _ZERO
    else:
        if agreement > _ZERO:
            step = min(step * _GROW, _LARGEST)
        # By comparisons, for a GPU's compiler knows no sign; 0 stays 0, and what is not a number stays visible.
        last_change = -step if g > _ZERO else step if g < _ZERO else -g
        w += last_change
        last_gradient = g
    return w, step, last_gradient, last_change


@exact
def _update(w, step, last_gradient, last_change, gradient, backtrack):  # type: ignore[no-untyped-def]  # compiled
    for i in range(w.size):
        w[i], step[i], last_gradient[i], last_change[i] = changed(
            gradient[i], w[i], step[i], last_gradient[i], last_change[i], backtrack
        )


@exact
def train_network(w, step, last_gradient, last_change, X, target, counts, n, iterations, backtrack, squashed, flat):  # type: ignore[no-untyped-def]  # compiled
    """Iterate one network in place; all arrays float32, the first four (W,), X (5, >= n), target, counts (>= n,) or empty."""
    hidden_out = np.empty(((w.size - 1) // PER_NEURON, BLOCK), np.float32)
    out, error = np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    gradient = np.empty(w.size, np.float32)
    absent, inputs = last_input_is_absent(X, n), _prepared(X, n, _block(n))
    for _ in range(iterations):
        _gradient_into(w, X, inputs, target, counts, n, absent, gradient, hidden_out, out, error, squashed, flat)
        _update(w, step, last_gradient, last_change, gradient, backtrack)


def gradient(
    weights: np.ndarray,
    X: np.ndarray,
    target: np.ndarray,
    counts: np.ndarray | None = None,
    sigmoid_output: bool = False,
    flat_spot: float = 0.0,
) -> np.ndarray:
    """Gradient (W,) of one network: half the summed squared error over X (5, n) and target (n,), pattern by counts (n,)."""
    result = np.empty(weights.size, np.float32)
    counts = _ALL_ALIKE if counts is None else counts
    gradient_into(weights, X, target, counts, X.shape[1], result, sigmoid_output, np.float32(flat_spot))
    return result
