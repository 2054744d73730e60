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
from bns.physics.model import Model

REACH_S = 0.6
"""Clocks are first sought this far on either side of where they are."""
_SCAN = 25
_SMALL_S = 1e-3
_STIFFNESS = 4.0
"""Curvature that every clock has by itself (1/s², one over half a second squared): a trial that says nothing keeps its own."""
_ROUNDS = 8
_SETTLED_S = 2e-4


class Follower(Protocol):
    """What is asked of a fitting problem here."""

    def white(self, model: Model) -> Array:
        """Whitened innovations, (frames, 3)."""

    def per_trial(self, values: Array) -> Array:
        """Sums over the frames of each trial."""

    @property
    def frame_trial(self) -> np.ndarray:
        """The trial of every frame."""


@dataclass(frozen=True)
class Slopes:
    """The Jacobian of shared numbers, (frames, 3, p), free of what the trials' own clocks could do as well.

    ``answer`` (trials, p): how far each clock moves with a unit of each number; ``pull``, ``stiffness`` (trials,): gradient and
    curvature along the clock. All three are None where trials have no clocks of their own.
    """

    jacobian: Array
    answer: Array | None = None
    pull: Array | None = None
    stiffness: Array | None = None

    def moved(self, model: Model, step: Array, damping: float) -> Model:
        """The model with its clocks moved as a step of the shared numbers asks for."""
        if self.answer is None or self.pull is None or self.stiffness is None:
            return model
        return _shifted(model, self.answer @ step - self.pull / (self.stiffness * (1 + damping)))


def without_clocks(problem: Follower, model: Model, white: Array, jacobian: Array) -> Slopes:
    """The slopes of shared numbers, the model's own clocks eliminated where it has any."""
    if model.differing is None:
        return Slopes(jacobian)
    slope, pull, stiffness = _along(problem, model, white)
    shared = problem.per_trial(np.einsum("kc,kcp->kp", slope * weights(white)[:, None], jacobian))
    answer = -shared / stiffness[:, None]
    return Slopes(jacobian + slope[:, :, None] * answer[problem.frame_trial][:, None, :], answer, pull, stiffness)


def with_clocks_begun(problem: Follower, model: Model, trials: int) -> Model:
    """The model with a value for each trial's clock, sought on a grid where none is known yet."""
    differing = model.differing
    if differing is None or len(differing.own) == trials:
        return model
    return with_clocks_set(problem, _scanned(problem, model.with_own(np.repeat(differing.values, trials))))


def with_clocks_set(problem: Follower, model: Model) -> Model:
    """Every clock where its own trial is foreseen best; nothing else moves."""
    white = problem.white(model)
    losses = problem.per_trial(huber(white))
    share = np.ones(len(losses))
    for _ in range(_ROUNDS):
        _, pull, stiffness = _along(problem, model, white)
        step = -share * pull / stiffness
        if np.abs(step).max(initial=0.0) < _SETTLED_S:
            break
        better = problem.per_trial(huber(problem.white(_shifted(model, step)))) <= losses
        model = _shifted(model, np.where(better, step, 0.0))
        share = np.where(better, 1.0, share / 4)
        white = problem.white(model)
        losses = problem.per_trial(huber(white))
    return model


def _scanned(problem: Follower, model: Model) -> Model:
    """Every clock at the best of a grid of shifts."""
    shifts = np.linspace(-REACH_S, REACH_S, _SCAN)
    losses = np.array([problem.per_trial(huber(problem.white(_shifted(model, float(s))))) for s in shifts])
    return _shifted(model, shifts[np.argmin(losses, axis=0)])


def _along(problem: Follower, model: Model, white: Array) -> tuple[Array, Array, Array]:
    """Slope of the innovations along each frame's own clock (frames, 3), then gradient and curvature of each clock (trials,)."""
    slope = (problem.white(_shifted(model, _SMALL_S)) - white) / _SMALL_S
    weighted = slope * weights(white)[:, None]
    pull = problem.per_trial((weighted * white).sum(axis=1))
    return slope, pull, problem.per_trial((weighted * slope).sum(axis=1)) + _STIFFNESS


def _shifted(model: Model, by_s: Array | float) -> Model:
    differing = model.differing
    assert differing is not None
    p = differing.effect.parameters[0]
    return model.with_own(np.clip(np.array(differing.own) + by_s, p.low, p.high))
