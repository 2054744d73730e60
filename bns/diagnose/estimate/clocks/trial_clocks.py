"""Clocks that differ from trial to trial: one unknown number a trial, set beside the numbers that all trials share.

Each trial's offset enters that trial's frames alone, so the normal equations have the shape of an arrow: the offsets are
eliminated one by one (Schur complement), and what is left speaks of the shared numbers alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.noise import huber, weights
from bns.diagnose.settings import DEFAULTS
from bns.physics.model import Model

REACH_S = DEFAULTS.estimate.trial_clock_reach_s
_SCAN = DEFAULTS.estimate.trial_clock_scan
_SMALL_S = DEFAULTS.estimate.trial_clock_small_s
_STIFFNESS = DEFAULTS.estimate.trial_clock_stiffness
_ROUNDS = DEFAULTS.estimate.trial_clock_rounds
_SETTLED_S = DEFAULTS.estimate.trial_clock_settled_s


class Follower(Protocol):
    """What is asked of a fitting problem here."""

    def whitened(self, model: Model) -> Array:
        """Whitened innovations, (frames, 3)."""

    def per_trial(self, values: Array) -> Array:
        """Sums over the frames of each trial."""

    @property
    def frame_trial(self) -> np.ndarray:
        """The trial of every frame."""


@dataclass(frozen=True)
class ReducedJacobian:
    """The Jacobian of shared numbers, (frames, 3, p), free of what the trials' own clocks could do as well.

    ``clock_response`` (trials, p): how far each clock moves with a unit of each number;
    ``clock_gradient``, ``clock_curvature`` (trials,): along the clock.
    All three are None where trials have no clocks of their own.
    """

    jacobian: Array
    clock_response: Array | None = None
    clock_gradient: Array | None = None
    clock_curvature: Array | None = None

    def moved(self, model: Model, step: Array, damping: float) -> Model:
        """The model with its clocks moved as a step of the shared numbers asks for."""
        if self.clock_response is None or self.clock_gradient is None or self.clock_curvature is None:
            return model
        return _shifted(
            model, self.clock_response @ step - self.clock_gradient / (self.clock_curvature * (1 + damping))
        )


def eliminate_clocks(problem: Follower, model: Model, whitened: Array, jacobian: Array) -> ReducedJacobian:
    """The Jacobian of shared numbers, the model's own clocks eliminated where it has any."""
    if model.per_trial_effect is None:
        return ReducedJacobian(jacobian)
    slope, gradient, curvature = _along(problem, model, whitened)
    shared = problem.per_trial(np.einsum("kc,kcp->kp", slope * weights(whitened)[:, None], jacobian))
    response = -shared / curvature[:, None]
    return ReducedJacobian(
        jacobian + slope[:, :, None] * response[problem.frame_trial][:, None, :], response, gradient, curvature
    )


def with_initial_clocks(problem: Follower, model: Model, trials: int) -> Model:
    """The model with a value for each trial's clock, sought on a grid where none is known yet."""
    per_trial_effect = model.per_trial_effect
    if per_trial_effect is None or len(per_trial_effect.trial_values) == trials:
        return model
    return with_fitted_clocks(
        problem, _scanned(problem, model.with_trial_values(np.repeat(per_trial_effect.values, trials)))
    )


def with_fitted_clocks(problem: Follower, model: Model) -> Model:
    """Every clock where its own trial is foreseen best; nothing else moves."""
    whitened = problem.whitened(model)
    losses = problem.per_trial(huber(whitened))
    share = np.ones(len(losses))
    for _ in range(_ROUNDS):
        _, gradient, curvature = _along(problem, model, whitened)
        step = -share * gradient / curvature
        if np.abs(step).max(initial=0.0) < _SETTLED_S:
            break
        better = problem.per_trial(huber(problem.whitened(_shifted(model, step)))) <= losses
        model = _shifted(model, np.where(better, step, 0.0))
        share = np.where(better, 1.0, share / 4)
        whitened = problem.whitened(model)
        losses = problem.per_trial(huber(whitened))
    return model


def _scanned(problem: Follower, model: Model) -> Model:
    """Every clock at the best of a grid of shifts."""
    shifts = np.linspace(-REACH_S, REACH_S, _SCAN)
    losses = np.array([problem.per_trial(huber(problem.whitened(_shifted(model, float(s))))) for s in shifts])
    return _shifted(model, shifts[np.argmin(losses, axis=0)])


def _along(problem: Follower, model: Model, whitened: Array) -> tuple[Array, Array, Array]:
    """Slope of the innovations along each frame's own clock (frames, 3), then gradient and curvature of each clock (trials,)."""
    slope = (problem.whitened(_shifted(model, _SMALL_S)) - whitened) / _SMALL_S
    weighted = slope * weights(whitened)[:, None]
    gradient = problem.per_trial((weighted * whitened).sum(axis=1))
    return slope, gradient, problem.per_trial((weighted * slope).sum(axis=1)) + _STIFFNESS


def _shifted(model: Model, by_s: Array | float) -> Model:
    per_trial_effect = model.per_trial_effect
    assert per_trial_effect is not None
    p = per_trial_effect.effect.parameters[0]
    return model.with_trial_values(np.clip(np.array(per_trial_effect.trial_values) + by_s, p.low, p.high))
