"""Rprop on a GPU: one warp trains one network of one run, all iterations in one launch.

The hidden neurons are shared out among the lanes of a warp, four or five each, and stay in registers with their gradients; what
lanes are left takes further patterns at the same time. Only an output's sum and, once an iteration, the gradient cross lanes.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from numba import cuda, float32

from bns.engine.backward import share
from bns.engine.rprop import INITIAL_STEP, changed, residual, squashed_residual
from bns.engine.snn import PER_NEURON, activation, neuron, weight_count

WARP = 32
MOST, FEWEST = 5, 4
"""Hidden neurons a lane: 35 weights and as many gradients are what its registers hold."""
_BANKS_APART = 12
"""Rows this far apart, modulo 32, let 8 x 4 lanes write 35 numbers each without two of them meeting in a bank."""
_ALL = 0xFFFFFFFF
_ZERO, _BEGIN = np.float32(0), np.float32(INITIAL_STEP)


def layout_of(hidden: int) -> tuple[int, int]:
    """Hidden neurons a lane, and lanes a pattern, a power of two: those that leave the fewest places empty."""
    layouts = [(each, 1 << max(0, math.ceil(hidden / each) - 1).bit_length()) for each in (MOST, FEWEST)]
    fitting = [(each, lanes) for each, lanes in layouts if lanes <= WARP]
    if not fitting:
        raise ValueError(f"{hidden} hidden neurons; a warp holds {WARP * MOST}.")
    return min(fitting, key=lambda layout: layout[0] * layout[1])


def _pitch(width: int) -> int:
    return width + (_BANKS_APART - width) % WARP


@cuda.jit(device=True)
def _take(here, there, lane, last):  # type: ignore[no-untyped-def]  # compiled
    """One number for each weight of a network into shared memory; the output bias's to ``last``."""
    for i in range(lane, there.size, WARP):
        here[i if i < there.size - 1 else last] = there[i]


@cuda.jit(device=True)
def _give(here, there, lane, last):  # type: ignore[no-untyped-def]  # compiled
    """The inverse of `_take`."""
    for i in range(lane, there.size, WARP):
        there[i] = here[i if i < there.size - 1 else last]


@cuda.jit(device=True)
def _put(part, slot, k, v, g, to_output):  # type: ignore[no-untyped-def]  # compiled
    """The gradient of one hidden neuron over the patterns of a slot; v is its weight to the output."""
    part[slot, k] = v * g[0]
    part[slot, k + 1] = v * g[1]
    part[slot, k + 2] = v * g[2]
    part[slot, k + 3] = v * g[3]
    part[slot, k + 4] = v * g[4]
    part[slot, k + 5] = v * g[5]
    part[slot, k + 6] = to_output


@cache
def training_kernel(hidden: int, squashed: bool, counted: bool) -> Any:
    """Kernel for networks with so many hidden neurons; launch it on a grid (runs, networks) of blocks of `WARP` threads.

    squashed: their output is a sigmoid; counted: a pattern stands for as many as ``times`` says, otherwise that is not read.

    Arguments: the number of this evaluation; settings (runs,) of `bns.cuda.settings`; weights, step, last_gradient, last_change
    (runs, networks, W), X (runs, 5, capacity), targets and times (runs, networks, capacity), all float32; counts (runs,) int32.
    A run without patterns is left alone, and so is one that has ended.
    """
    each, lanes = layout_of(hidden)
    width, fifth, last = weight_count(hidden), each == MOST, (each - 1) * PER_NEURON
    slots, bias = WARP // lanes, lanes * each * PER_NEURON
    padded, rows = bias + 1, (slots, _pitch(bias + 1))
    error = squashed_residual if squashed else residual

    @cuda.jit(device=True)
    def summed(out):  # type: ignore[no-untyped-def]  # compiled
        """Over the lanes of a pattern."""
        apart = lanes // 2
        while apart > 0:
            out += cuda.shfl_xor_sync(_ALL, out, apart)
            apart //= 2
        return out

    @cuda.jit(fastmath=True)
    def train(evaluation, settings, weights, step, last_gradient, last_change, X, targets, times, counts):  # type: ignore[no-untyped-def]  # compiled
        w = cuda.shared.array(padded, float32)  # those of neurons that are not there stay 0
        steps = cuda.shared.array(width, float32)
        gradients = cuda.shared.array(width, float32)
        changes = cuda.shared.array(width, float32)
        part = cuda.shared.array(rows, float32)
        run, net, lane = cuda.blockIdx.x, cuda.blockIdx.y, cuda.threadIdx.x
        slot, first = lane // lanes, (lane % lanes) * each * PER_NEURON
        n, inputs, target = counts[run], X[run], targets[run, net]
        iterations, back = settings[run]["iterations"], settings[run]["backtrack"] != 0
        if n == 0 or evaluation > settings[run]["evaluations"]:
            return

        for i in range(lane, padded, WARP):
            w[i] = _ZERO
        cuda.syncthreads()
        _take(w, weights[run, net], lane, bias)
        _take(steps, step[run, net], lane, width - 1)
        _take(gradients, last_gradient[run, net], lane, width - 1)
        _take(changes, last_change[run, net], lane, width - 1)
        for _ in range(iterations):
            cuda.syncthreads()
            n0, n1 = neuron(w, first), neuron(w, first + PER_NEURON)
            n2, n3 = neuron(w, first + 2 * PER_NEURON), neuron(w, first + 3 * PER_NEURON)
            n4, output_bias = neuron(w, first + last), w[bias]  # of a lane with four neurons not used
            g0 = g1 = g2 = g3 = g4 = (_ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO)
            o0 = o1 = o2 = o3 = o4 = total = _ZERO
            for start in range(0, n, slots):
                p = min(start + slot, n - 1)
                x0, x1, x2, x3, x4 = inputs[0, p], inputs[1, p], inputs[2, p], inputs[3, p], inputs[4, p]
                h0, h1 = activation(n0, x0, x1, x2, x3, x4), activation(n1, x0, x1, x2, x3, x4)
                h2, h3 = activation(n2, x0, x1, x2, x3, x4), activation(n3, x0, x1, x2, x3, x4)
                out = n0[6] * h0 + n1[6] * h1 + n2[6] * h2 + n3[6] * h3
                if fifth:
                    h4 = activation(n4, x0, x1, x2, x3, x4)
                    out += n4[6] * h4
                e = error(summed(out) + output_bias, target[p])
                if counted:
                    e *= times[run, net, p]
                if start + slot >= n:
                    e = _ZERO
                total += e
                e0, e1, e2, e3 = e * h0, e * h1, e * h2, e * h3
                o0, o1, o2, o3 = o0 + e0, o1 + e1, o2 + e2, o3 + e3
                g0 = share(g0, e0 - e0 * h0, x0, x1, x2, x3, x4)
                g1 = share(g1, e1 - e1 * h1, x0, x1, x2, x3, x4)
                g2 = share(g2, e2 - e2 * h2, x0, x1, x2, x3, x4)
                g3 = share(g3, e3 - e3 * h3, x0, x1, x2, x3, x4)
                if fifth:
                    e4 = e * h4
                    o4 += e4
                    g4 = share(g4, e4 - e4 * h4, x0, x1, x2, x3, x4)
            _put(part, slot, first, n0[6], g0, o0)
            _put(part, slot, first + PER_NEURON, n1[6], g1, o1)
            _put(part, slot, first + 2 * PER_NEURON, n2[6], g2, o2)
            _put(part, slot, first + 3 * PER_NEURON, n3[6], g3, o3)
            if fifth:
                _put(part, slot, first + last, n4[6], g4, o4)
            if first == 0:
                part[slot, bias] = total
            cuda.syncthreads()
            for i in range(lane, width, WARP):
                at = i if i < width - 1 else bias
                g = part[0, at]
                for s in range(1, slots):
                    g += part[s, at]
                w[at], steps[i], gradients[i], changes[i] = changed(g, w[at], steps[i], gradients[i], changes[i], back)

        cuda.syncthreads()
        _give(w, weights[run, net], lane, bias)
        _give(steps, step[run, net], lane, width - 1)
        _give(gradients, last_gradient[run, net], lane, width - 1)
        _give(changes, last_change[run, net], lane, width - 1)

    return train


@cuda.jit
def restart(evaluation, settings, untrained, weights, step, last_gradient, last_change, failures):  # type: ignore[no-untyped-def]  # compiled
    """Begin every network anew that is no longer finite, and count it; a thread a network, arrays as above."""
    at = cuda.grid(1)
    run, net = at // weights.shape[1], at % weights.shape[1]
    if run >= weights.shape[0] or evaluation > settings[run]["evaluations"]:
        return
    finite = True
    for i in range(weights.shape[2]):
        finite = finite and math.isfinite(weights[run, net, i])
    if finite:
        return
    cuda.atomic.add(failures, run, 1)
    for i in range(weights.shape[2]):
        weights[run, net, i] = untrained[run, net, i]
        step[run, net, i] = _BEGIN
        last_gradient[run, net, i] = _ZERO
        last_change[run, net, i] = _ZERO
