"""The way through a network and back, sixteen patterns at a time: for processors with 32 registers of sixteen numbers.

The sums of `bns.engine.narrow`, written in vectors (`bns.engine.vector`) for three reasons. A block of patterns that is no
multiple of sixteen ends in one more vector on the way forward, where the compiler's loops go on with single patterns. Weights
stay in registers there, because only two neurons are taken at a time. On the way back, sums of neurons are added up together.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bns.engine.jit import exact, inline, larger, smaller
from bns.engine.snn import BLOCK, DENOMINATOR, GROUP, HALF, INPUTS, NUMERATOR, PER_NEURON, SATURATED
from bns.engine.vector import (
    LANES,
    add_products,
    fma,
    halves,
    load,
    over,
    plus,
    spread,
    store,
    sum_of,
    sums,
    times,
    without,
)

_ONE, _ZERO = np.float32(1), np.float32(0)
_REST = INPUTS * BLOCK
"""Where a block holds the patterns behind its last full vector once more, each as a vector."""
_SIZE = _REST + LANES * LANES
_TOGETHER = 4
"""So many patterns of the rest are added up side by side."""


@exact
def prepared(X, n, block):  # type: ignore[no-untyped-def]  # compiled
    """Inputs (5, >= n) in blocks (blocks, numbers): one after the other, `BLOCK` numbers each, 0 behind the last pattern; then
    the rest, each pattern as what the errors of two neurons are multiplied by."""
    blocks = np.zeros((-(-n // block), _SIZE), np.float32)
    for p in range(n):
        for i in range(INPUTS):
            blocks[p // block, i * BLOCK + p % block] = X[i, p]
    for number in range(blocks.shape[0]):
        size = min(block, n - number * block)
        for p in range(size & -LANES, size):
            for at in range(_REST + p % LANES * LANES, _REST + (p % LANES + 1) * LANES, LANES // 2):
                for i in range(INPUTS):
                    blocks[number, at + i] = blocks[number, i * BLOCK + p]
                blocks[number, at + INPUTS] = blocks[number, at + INPUTS + 1] = _ONE
    return blocks


@inline
def _sigmoid(x: Any) -> Any:
    """As `bns.engine.snn.sigmoid`."""
    x = larger(spread(-SATURATED), smaller(spread(SATURATED), x))  # type: ignore[call-arg]  # mypy sees the typing context
    s = times(x, x)
    p = fma(spread(NUMERATOR[0]), s, spread(NUMERATOR[1]))
    p = fma(p, s, spread(NUMERATOR[2]))
    p = fma(p, s, spread(NUMERATOR[3]))
    p = fma(p, s, spread(NUMERATOR[4]))
    q = fma(spread(DENOMINATOR[0]), s, spread(DENOMINATOR[1]))
    q = fma(q, s, spread(DENOMINATOR[2]))
    q = fma(q, s, spread(DENOMINATOR[3]))
    return plus(spread(HALF), over(times(x, p), q))


@inline
def _neuron(w: Any, k: Any) -> Any:
    """Weights of the hidden neuron that begins at k, each in all lanes."""
    into = spread(w[k]), spread(w[k + 1]), spread(w[k + 2]), spread(w[k + 3]), spread(w[k + 4])
    return into, spread(w[k + 5]), spread(w[k + 6])


@inline
def _of_four(n: Any, x0: Any, x1: Any, x2: Any, x3: Any) -> Any:
    """What goes into a neuron without the last input."""
    return fma(n[0][3], x3, fma(n[0][2], x2, fma(n[0][1], x1, fma(n[0][0], x0, n[1]))))


@inline
def _two_forward(P, w, first, second, hidden_out, out, size, absent):  # type: ignore[no-untyped-def]  # compiled
    """Activations of two hidden neurons, and their shares of the output: the first one's is added first."""
    m, n = _neuron(w, first * PER_NEURON), _neuron(w, second * PER_NEURON)
    to_m, to_n = first * BLOCK, second * BLOCK
    if absent:
        for p in range(0, size, LANES):
            x0, x1, x2, x3 = load(P, p), load(P, p + BLOCK), load(P, p + 2 * BLOCK), load(P, p + 3 * BLOCK)
            s, t = _sigmoid(_of_four(m, x0, x1, x2, x3)), _sigmoid(_of_four(n, x0, x1, x2, x3))
            store(hidden_out, to_m + p, s)
            store(hidden_out, to_n + p, t)
            store(out, p, fma(n[2], t, fma(m[2], s, load(out, p))))
    else:
        for p in range(0, size, LANES):
            x0, x1, x2, x3 = load(P, p), load(P, p + BLOCK), load(P, p + 2 * BLOCK), load(P, p + 3 * BLOCK)
            x4 = load(P, p + 4 * BLOCK)
            s, t = fma(m[0][4], x4, _of_four(m, x0, x1, x2, x3)), fma(n[0][4], x4, _of_four(n, x0, x1, x2, x3))
            s, t = _sigmoid(s), _sigmoid(t)
            store(hidden_out, to_m + p, s)
            store(hidden_out, to_n + p, t)
            store(out, p, fma(n[2], t, fma(m[2], s, load(out, p))))


@exact
def forward(blocks, number, w, hidden_out, out, a, b, absent):  # type: ignore[no-untyped-def]  # compiled
    """All hidden neurons' share of the output of patterns a..b, block ``number``; activations into hidden_out (hidden, `BLOCK`).

    out (`BLOCK`,): what stands in it behind the last pattern is of no use.
    """
    P, activations = blocks[number], hidden_out.reshape(-1)
    out[:] = _ZERO
    for k in range(0, hidden_out.shape[0], GROUP):
        _two_forward(P, w, k + 1, k, activations, out, b - a, absent)  # the order in which others add them
        _two_forward(P, w, k + 2, k + 3, activations, out, b - a, absent)


@exact
def total(error, _as_compiled):  # type: ignore[no-untyped-def]  # compiled
    """The sum of all errors: in four vectors, then in eight sums, then one by one."""
    size, p, whole = error.size, 0, _ZERO
    if size >= 4 * LANES:
        s0, s1, s2, s3 = spread(_ZERO), spread(_ZERO), spread(_ZERO), spread(_ZERO)
        while p + 4 * LANES <= size:
            s0, s1 = plus(s0, load(error, p)), plus(s1, load(error, p + LANES))
            s2, s3 = plus(s2, load(error, p + 2 * LANES)), plus(s3, load(error, p + 3 * LANES))
            p += 4 * LANES
        whole = sum_of(plus(plus(s0, s1), plus(s2, s3)))
    if p + 8 <= size:
        e0, e1, e2, e3, e4, e5, e6, e7 = whole, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO
        while p + 8 <= size:
            e0, e1, e2, e3 = e0 + error[p], e1 + error[p + 1], e2 + error[p + 2], e3 + error[p + 3]
            e4, e5, e6, e7 = e4 + error[p + 4], e5 + error[p + 5], e6 + error[p + 6], e7 + error[p + 7]
            p += 8
        whole = ((e0 + e4) + (e2 + e6)) + ((e1 + e5) + (e3 + e7))
    while p < size:
        whole += error[p]
        p += 1
    return whole


@inline
def _with(g: Any, d: Any, o: Any, x0: Any, x1: Any, x2: Any, x3: Any) -> Any:
    """A neuron's sums for inputs, bias and output with more patterns, without those for the last input."""
    return fma(d, x0, g[0]), fma(d, x1, g[1]), fma(d, x2, g[2]), fma(d, x3, g[3]), g[4], plus(g[5], d), plus(g[6], o), g[7]


@inline
def _with_last(g: Any, d: Any, x4: Any) -> Any:
    return g[0], g[1], g[2], g[3], fma(d, x4, g[4]), g[5], g[6], g[7]


@inline
def _four_back(P, k, activations, error, full):  # type: ignore[no-untyped-def]  # compiled
    """Sums of four neurons over as many patterns as fill vectors, two neurons in a vector."""
    zero = spread(_ZERO)
    nothing = (zero, zero, zero, zero, zero, zero, zero, zero)
    g0, g1, g2, g3 = nothing, nothing, nothing, nothing
    for p in range(0, full, LANES):
        at, e = k * BLOCK + p, load(error, p)
        x0, x1, x2, x3 = load(P, p), load(P, p + BLOCK), load(P, p + 2 * BLOCK), load(P, p + 3 * BLOCK)
        x4 = load(P, p + 4 * BLOCK)
        h0, h1 = load(activations, at), load(activations, at + BLOCK)
        h2, h3 = load(activations, at + 2 * BLOCK), load(activations, at + 3 * BLOCK)
        o0, o1, o2, o3 = times(e, h0), times(e, h1), times(e, h2), times(e, h3)
        d0, d1, d2, d3 = without(o0, h0, o0), without(o1, h1, o1), without(o2, h2, o2), without(o3, h3, o3)
        g0, g1 = _with(g0, d0, o0, x0, x1, x2, x3), _with(g1, d1, o1, x0, x1, x2, x3)
        g2, g3 = _with(g2, d2, o2, x0, x1, x2, x3), _with(g3, d3, o3, x0, x1, x2, x3)
        g0, g1, g2, g3 = _with_last(g0, d0, x4), _with_last(g1, d1, x4), _with_last(g2, d2, x4), _with_last(g3, d3, x4)
    return sums(g0, g1), sums(g2, g3)


@inline
def _four_back_of_four(P, k, activations, error, full):  # type: ignore[no-untyped-def]  # compiled
    """As `_four_back`, where the last input is 0."""
    zero = spread(_ZERO)
    nothing = (zero, zero, zero, zero, zero, zero, zero, zero)
    g0, g1, g2, g3 = nothing, nothing, nothing, nothing
    for p in range(0, full, LANES):
        at, e = k * BLOCK + p, load(error, p)
        x0, x1, x2, x3 = load(P, p), load(P, p + BLOCK), load(P, p + 2 * BLOCK), load(P, p + 3 * BLOCK)
        h0, h1 = load(activations, at), load(activations, at + BLOCK)
        h2, h3 = load(activations, at + 2 * BLOCK), load(activations, at + 3 * BLOCK)
        o0, o1, o2, o3 = times(e, h0), times(e, h1), times(e, h2), times(e, h3)
        d0, d1, d2, d3 = without(o0, h0, o0), without(o1, h1, o1), without(o2, h2, o2), without(o3, h3, o3)
        g0, g1 = _with(g0, d0, o0, x0, x1, x2, x3), _with(g1, d1, o1, x0, x1, x2, x3)
        g2, g3 = _with(g2, d2, o2, x0, x1, x2, x3), _with(g3, d3, o3, x0, x1, x2, x3)
    return sums(g0, g1), sums(g2, g3)


@inline
def _one_more(total, P, p, activations, at, error):  # type: ignore[no-untyped-def]  # compiled
    """Sums of two neurons with pattern p, one of the rest; at: where the first neuron's activations begin."""
    h, g, e, behind = activations[at + p], activations[at + BLOCK + p], error[p], _REST + p % LANES * LANES
    o, q = e * h, e * g
    return fma(halves(without(o, h, o), o, without(q, g, q), q), load(P, behind), total)


@inline
def _end(P, w, k, activations, error, gradient, full, size, total):  # type: ignore[no-untyped-def]  # compiled
    """Add to the gradient the sums of two neurons, once the rest has been added to them."""
    at, p = k * BLOCK, full
    if p + _TOGETHER <= size:
        second = third = fourth = spread(_ZERO)
        while p + _TOGETHER <= size:
            total = _one_more(total, P, p, activations, at, error)
            second = _one_more(second, P, p + 1, activations, at, error)
            third = _one_more(third, P, p + 2, activations, at, error)
            fourth = _one_more(fourth, P, p + 3, activations, at, error)
            p += _TOGETHER
        total = plus(plus(total, third), plus(second, fourth))
    while p < size:
        total = _one_more(total, P, p, activations, at, error)
        p += 1
    begin = k * PER_NEURON
    v = halves(w[begin + PER_NEURON - 1], _ONE, w[begin + 2 * PER_NEURON - 1], _ONE)
    add_products(gradient, begin, PER_NEURON, v, total)


@exact
def backward(blocks, number, w, hidden_out, error, gradient, a, b, absent):  # type: ignore[no-untyped-def]  # compiled
    """Add to gradient (W,) what patterns a..b, block ``number``, give to all hidden neurons."""
    P, activations, size = blocks[number], hidden_out.reshape(-1), b - a
    full = size & -LANES
    for k in range(0, hidden_out.shape[0], GROUP):
        if absent:
            front, back = _four_back_of_four(P, k, activations, error, full)
        else:
            front, back = _four_back(P, k, activations, error, full)
        _end(P, w, k, activations, error, gradient, full, size, front)
        _end(P, w, k + 2, activations, error, gradient, full, size, back)
