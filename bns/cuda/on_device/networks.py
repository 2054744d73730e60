"""Networks read by one thread of a GPU."""

from __future__ import annotations

from numba import cuda

from bns.engine.snn import PER_NEURON, activation, neuron, sigmoid


@cuda.jit(device=True)
def output(w, at, width, x0, x1, x2, x3, x4):  # type: ignore[no-untyped-def]  # compiled
    """Output for one pattern of the network whose weights are w[at : at + width]; linear."""
    out = w[at + width - 1]
    for k in range(at, at + width - 1, PER_NEURON):
        n = neuron(w, k)
        out += n[6] * activation(n, x0, x1, x2, x3, x4)
    return out


@cuda.jit(device=True)
def squashed_output(w, at, width, x0, x1, x2, x3, x4):  # type: ignore[no-untyped-def]  # compiled
    """As `output`, of a network whose output is a sigmoid itself."""
    return sigmoid(output(w, at, width, x0, x1, x2, x3, x4))
