"""The way back through a network's hidden neurons: what their weights' gradients get from the errors of a block of patterns.

In two forms. Four neurons at a time read each pattern once for all of them, but have to keep 28 sums: that is for processors with
32 vector registers. Where there are 16, one neuron at a time is twice as fast, because no sum is stored in between; the sums are
the same ones in the same order there.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bns.engine.jit import MANY_REGISTERS, fast, inline
from bns.engine.snn import GROUP, PER_NEURON

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
def _four(X, w, first, hidden_out, error, gradient, a, b):  # type: ignore[no-untyped-def]  # compiled
    x0, x1, x2, x3, x4 = X[0, a:b], X[1, a:b], X[2, a:b], X[3, a:b], X[4, a:b]
    h0, h1 = hidden_out[first, : b - a], hidden_out[first + 1, : b - a]
    h2, h3 = hidden_out[first + 2, : b - a], hidden_out[first + 3, : b - a]
    g0 = g1 = g2 = g3 = (_ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO)
    o0 = o1 = o2 = o3 = _ZERO
    for p in range(error.size):
        e, v0, v1, v2, v3, v4 = error[p], x0[p], x1[p], x2[p], x3[p], x4[p]
        g0, o0 = _with(g0, o0, e * h0[p], h0[p], v0, v1, v2, v3, v4)
        g1, o1 = _with(g1, o1, e * h1[p], h1[p], v0, v1, v2, v3, v4)
        g2, o2 = _with(g2, o2, e * h2[p], h2[p], v0, v1, v2, v3, v4)
        g3, o3 = _with(g3, o3, e * h3[p], h3[p], v0, v1, v2, v3, v4)
    k = first * PER_NEURON
    write(gradient, w, k, g0, o0)
    write(gradient, w, k + PER_NEURON, g1, o1)
    write(gradient, w, k + 2 * PER_NEURON, g2, o2)
    write(gradient, w, k + 3 * PER_NEURON, g3, o3)


@fast
def _four_of_four(X, w, first, hidden_out, error, gradient, a, b):  # type: ignore[no-untyped-def]  # compiled
    x0, x1, x2, x3 = X[0, a:b], X[1, a:b], X[2, a:b], X[3, a:b]
    h0, h1 = hidden_out[first, : b - a], hidden_out[first + 1, : b - a]
    h2, h3 = hidden_out[first + 2, : b - a], hidden_out[first + 3, : b - a]
    g0 = g1 = g2 = g3 = (_ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO)
    o0 = o1 = o2 = o3 = _ZERO
    for p in range(error.size):
        e, v0, v1, v2, v3 = error[p], x0[p], x1[p], x2[p], x3[p]
        g0, o0 = _with_of_four(g0, o0, e * h0[p], h0[p], v0, v1, v2, v3)
        g1, o1 = _with_of_four(g1, o1, e * h1[p], h1[p], v0, v1, v2, v3)
        g2, o2 = _with_of_four(g2, o2, e * h2[p], h2[p], v0, v1, v2, v3)
        g3, o3 = _with_of_four(g3, o3, e * h3[p], h3[p], v0, v1, v2, v3)
    k = first * PER_NEURON
    write(gradient, w, k, g0, o0)
    write(gradient, w, k + PER_NEURON, g1, o1)
    write(gradient, w, k + 2 * PER_NEURON, g2, o2)
    write(gradient, w, k + 3 * PER_NEURON, g3, o3)


@fast
def four_at_once(X, w, hidden_out, error, gradient, a, b, absent):  # type: ignore[no-untyped-def]  # compiled
    """Add to gradient (W,) what patterns a..b give to all hidden neurons, four neurons at a time.

    absent: the last input is 0 in all of them (`bns.engine.snn.last_input_is_absent`), and not worked on.
    """
    for first in range(0, (w.size - 1) // PER_NEURON, GROUP):
        if absent:
            _four_of_four(X, w, first, hidden_out, error, gradient, a, b)
        else:
            _four(X, w, first, hidden_out, error, gradient, a, b)


@fast
def one_at_once(X, w, hidden_out, error, gradient, a, b, absent):  # type: ignore[no-untyped-def]  # compiled
    """As `four_at_once`, one neuron after the other."""
    for neuron in range((w.size - 1) // PER_NEURON):
        if absent:
            _one_of_four(X, w, neuron, hidden_out, error, gradient, a, b)
        else:
            _one(X, w, neuron, hidden_out, error, gradient, a, b)


backward = four_at_once if MANY_REGISTERS else one_at_once
