"""The way back through a network's hidden neurons: what their weights' gradients get from the errors of a block of patterns."""

from __future__ import annotations

from typing import Any

import numpy as np

from bns.engine.jit import fast, inline
from bns.engine.snn import PER_NEURON

_ZERO = np.float32(0)


@inline
def share(g: Any, d: Any, x0: Any, x1: Any, x2: Any, x3: Any, x4: Any) -> Any:
    """The input sums of a hidden neuron (6,) with one more pattern, whose error reaches it as d."""
    return g[0] + d * x0, g[1] + d * x1, g[2] + d * x2, g[3] + d * x3, g[4] + d * x4, g[5] + d


@inline
def _share_of_four(g: Any, d: Any, x0: Any, x1: Any, x2: Any, x3: Any) -> Any:
    """As `share` without the last input, whose sum stays as it is."""
    return g[0] + d * x0, g[1] + d * x1, g[2] + d * x2, g[3] + d * x3, g[4], g[5] + d


@inline
def write(gradient: Any, w: Any, k: Any, g: Any, to_output: Any) -> None:
    """Add to the gradient what the sums g of the neuron that begins at k come to."""
    v = w[k + 6]
    gradient[k] += v * g[0]
    gradient[k + 1] += v * g[1]
    gradient[k + 2] += v * g[2]
    gradient[k + 3] += v * g[3]
    gradient[k + 4] += v * g[4]
    gradient[k + 5] += v * g[5]
    gradient[k + 6] += to_output


@inline
def _with(g: Any, o: Any, e: Any, h: Any, x0: Any, x1: Any, x2: Any, x3: Any, x4: Any) -> Any:
    """A neuron's input sums and its output's with one more pattern, where the output's error times activation h is e."""
    return share(g, e - e * h, x0, x1, x2, x3, x4), o + e


@inline
def _with_of_four(g: Any, o: Any, e: Any, h: Any, x0: Any, x1: Any, x2: Any, x3: Any) -> Any:
    """As `_with`, where the last input is 0."""
    return _share_of_four(g, e - e * h, x0, x1, x2, x3), o + e


@fast
def _one(X, w, neuron, hidden_out, error, gradient, a, b):  # type: ignore[no-untyped-def]  # compiled
    x0, x1, x2, x3, x4 = X[0, a:b], X[1, a:b], X[2, a:b], X[3, a:b], X[4, a:b]
    h, g, o = hidden_out[neuron, : b - a], (_ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO), _ZERO
    for p in range(error.size):
        g, o = _with(g, o, error[p] * h[p], h[p], x0[p], x1[p], x2[p], x3[p], x4[p])
    write(gradient, w, neuron * PER_NEURON, g, o)


@fast
def _one_of_four(X, w, neuron, hidden_out, error, gradient, a, b):  # type: ignore[no-untyped-def]  # compiled
    x0, x1, x2, x3 = X[0, a:b], X[1, a:b], X[2, a:b], X[3, a:b]
    h, g, o = hidden_out[neuron, : b - a], (_ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO), _ZERO
    for p in range(error.size):
        g, o = _with_of_four(g, o, error[p] * h[p], h[p], x0[p], x1[p], x2[p], x3[p])
    write(gradient, w, neuron * PER_NEURON, g, o)


@fast
def one_at_once(X, w, hidden_out, error, gradient, a, b, absent):  # type: ignore[no-untyped-def]  # compiled
    """Add to gradient (W,) what patterns a..b give to all hidden neurons, one after the other.

    absent: the last input is 0 in all of them (`bns.engine.snn.last_input_is_absent`), and not worked on.
    """
    for neuron in range((w.size - 1) // PER_NEURON):
        if absent:
            _one_of_four(X, w, neuron, hidden_out, error, gradient, a, b)
        else:
            _one(X, w, neuron, hidden_out, error, gradient, a, b)

