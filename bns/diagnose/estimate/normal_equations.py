"""The normal equations of a step of least squares, for all frames and trial by trial, as products of matrices."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.noise import weights
from bns.diagnose.estimate.pseudo_inverse import pseudo_inverse


@dataclass(frozen=True)
class NormalEquations:
    """``gradients`` (trials, p) and ``curvatures`` (trials, p, p) of the robust loss in p numbers, each trial's own."""

    gradients: Array
    curvatures: Array


def normal_equations(jacobian: Array, whitened: Array) -> tuple[Array, Array]:
    """Curvature (p, p) and gradient (p,) over all frames, of a Jacobian (frames, 3, p) at the innovations (frames, 3)."""
    flat, weighted = _flat(jacobian), _flat(jacobian * weights(whitened)[:, None, None])
    return weighted.T @ flat, weighted.T @ whitened.ravel()


def normal_equations_by_trial(first: NDArray[np.int64], jacobian: Array, whitened: Array) -> NormalEquations:
    """The same for each trial; ``first`` (trials + 1): where its frames begin."""
    weighted = jacobian * weights(whitened)[:, None, None]
    p = jacobian.shape[2]
    gradients, curvatures = np.empty((len(first) - 1, p)), np.empty((len(first) - 1, p, p))
    for trial, (a, b) in enumerate(pairwise(first)):
        part = _flat(weighted[a:b]).T
        gradients[trial], curvatures[trial] = part @ whitened[a:b].ravel(), part @ _flat(jacobian[a:b])
    return NormalEquations(gradients, curvatures)


def damped_step(curvature: Array, gradient: Array, damping: float) -> Array:
    """The step of least squares, shortened by so much of the curvature's diagonal."""
    if not len(gradient):
        return np.zeros(0)
    scale = np.diag(curvature).copy()
    scale[scale <= 0] = 1.0
    return np.asarray(-pseudo_inverse(curvature + damping * np.diag(scale)) @ gradient, dtype=np.float64)


def predicted_decrease_of(step: Array, curvature: Array, gradient: Array) -> float:
    """By how much a step lowers the loss, by the gradient and the curvature."""
    return float(-(gradient @ step) - step @ curvature @ step / 2)


def innovations_after(first: NDArray[np.int64], jacobian: Array, whitened: Array, steps: Array) -> Array:
    """The innovations (frames, 3) after a step of its own in each trial, ``steps`` (trials, p); to first order."""
    moved = whitened.copy()
    for step, (a, b) in zip(steps, pairwise(first), strict=True):
        moved[a:b] += (_flat(jacobian[a:b]) @ step).reshape(-1, whitened.shape[1])
    return moved


def _flat(columns: Array) -> Array:
    """One row a whitened number, (frames * 3, p)."""
    return columns.reshape(columns.shape[0] * columns.shape[1], columns.shape[2])
