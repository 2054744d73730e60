"""The way through a network and back as `bns.engine.wide` offers it, in loops that the compiler turns into vectors.

For processors with 16 vector registers: there one neuron at a time on the way back is twice as fast as four, because no sum is
stored in between.
"""

from __future__ import annotations

import numpy as np

from bns.engine import snn
from bns.engine.backward import one_at_once
from bns.engine.jit import exact

_ZERO = np.float32(0)
_through = snn.forward


@exact
def prepared(X, _n, _block):  # type: ignore[no-untyped-def]  # compiled
    """Inputs (5, >= n) as they are."""
    return X


@exact
def forward(X, _number, w, hidden_out, out, a, b, absent):  # type: ignore[no-untyped-def]  # compiled
    """All hidden neurons' share of the output of patterns a..b; their activations into hidden_out (hidden, >= b - a)."""
    share = out[: b - a]
    share[:] = _ZERO
    _through(X, w, hidden_out, share, a, b, absent)


@exact
def total(_error, as_compiled):  # type: ignore[no-untyped-def]  # compiled
    """The sum of all errors as the loop that found them has added them up."""
    return as_compiled


@exact
def backward(X, _number, w, hidden_out, error, gradient, a, b, absent):  # type: ignore[no-untyped-def]  # compiled
    """Add to gradient (W,) what patterns a..b give to all hidden neurons."""
    one_at_once(X, w, hidden_out, error[: b - a], gradient, a, b, absent)
