"""Fit the numbers of a model's effects to tracks, and say how well they are known.

The unit of evidence is the trial: frames of one trial share what happened in it. Standard errors come from the scatter of
the trials' gradients (the sandwich estimator, clustered by trial); what a trial would lose if it had not been fitted
comes from one Newton step without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from bns.diagnose.clocks import Slopes, with_clocks_begun, without_clocks
from bns.diagnose.evidence import Evidence, held_out_gain, sign_flip_p
from bns.diagnose.noise import Filter, huber, weights
from bns.diagnose.predictor import Predictor
from bns.diagnose.tracks import Array
from bns.physics.effect import Parameter
from bns.physics.model import Model

_ROUNDS = 25
_SETTLED = 1e-2
"""A step that lowers the loss by less than this ends the search: numbers are then within a tenth of their standard error."""


@dataclass(frozen=True)
class Free:
    """One number that is fitted: which effect's, and which."""

    effect: str
    parameter: Parameter

    def of(self, model: Model) -> float:
        """Its value in a model."""
        return model.values_of(self.effect)[self.parameter.name]


@dataclass(frozen=True)
class Fit:
    """A fitted model. ``losses`` (trials,) as fitted; ``held_out`` (trials,) each trial judged by a fit without it.

    ``values``, ``covariance`` of the free numbers; ``gradients`` (trials, p), ``curvature`` (p, p) at the optimum.
    """

    model: Model
    free: tuple[Free, ...]
    values: Array
    covariance: Array
    losses: Array
    held_out: Array
    white: Array
    jacobian: Array

    @property
    def loss(self) -> float:
        """Sum over the trials, as fitted."""
        return float(self.losses.sum())

    def se(self, index: int) -> float:
        """Standard error of a number."""
        return float(np.sqrt(max(self.covariance[index, index], 0.0)))

    def interval(self, index: int, share: float = 0.95) -> tuple[float, float]:
        """Student's interval with as many degrees of freedom as there are trials to spare."""
        freedom = max(len(self.losses) - len(self.free), 1)
        half = float(student.ppf((1 + share) / 2, freedom)) * self.se(index)
        return float(self.values[index] - half), float(self.values[index] + half)


class Problem:
    """Tracks, a filter that follows them, and which numbers may be fitted."""

    def __init__(self, predictor: Predictor, following: Filter, counted: Array | None = None) -> None:
        """``counted`` (frames,): what each frame counts; 1 for all where it is not given."""
        self.predictor = predictor
        self.following = following
        self._counted = None if counted is None else np.sqrt(counted)[:, None]
        tracks = predictor.tracks
        self._trial, self._trials = tracks.trial, len(tracks)

    def white(self, model: Model) -> Array:
        """Whitened innovations under a model, (frames, 3)."""
        white = self.following.white(self.predictor.tracks, self.predictor.steps(model))
        return white if self._counted is None else white * self._counted

    @property
    def frame_trial(self) -> NDArray[np.int64]:
        """The trial of every frame, (frames,)."""
        return self._trial

    def per_trial(self, values: Array) -> Array:
        """Sums over the frames of each trial; (trials, ...)."""
        return np.add.reduceat(values, self.predictor.tracks.first[:-1], axis=0)

    def loss(self, model: Model) -> float:
        """Robust loss of all frames."""
        total = float(huber(self.white(model)).sum())
        return total if np.isfinite(total) else np.inf

    def free(self, model: Model) -> tuple[Free, ...]:
        """The numbers of the model's effects that all trials share and these tracks can speak of."""
        columns = self.predictor.tracks.extra
        return tuple(
            Free(active.effect.name, p)
            for active in model.effects
            if not active.per_trial
            for p in active.effect.parameters
            if not (p.column and p.column not in columns) and not (p.instead_of and p.instead_of in columns)
        )

    def stepped(self, model: Model) -> tuple[Model, float]:
        """One undamped step of least squares in all numbers; the model there and its loss."""
        free = self.free(model)
        white = self.white(model)
        slopes = self._slopes(model, free, white)
        there = self._moved(model, free, slopes, _damped_step(*_normal(slopes.jacobian, white), 1e-9), 0.0)
        return there, self.loss(there)

    def fit(self, model: Model, rounds: int | None = None) -> Fit:
        """Levenberg-Marquardt from the values the model has, within the bounds of every number; ``rounds`` 0 keeps them."""
        model = with_clocks_begun(self, model, self._trials)
        free = self.free(model)
        white = self.white(model)
        loss, damping = float(huber(white).sum()), 1e-3
        slopes = self._slopes(model, free, white)
        for _ in range(_ROUNDS if rounds is None and (free or model.differing) else 0):
            curvature, gradient = _normal(slopes.jacobian, white)
            moved = False
            for _ in range(8):
                step = _damped_step(curvature, gradient, damping)
                trial_model = self._moved(model, free, slopes, step, damping)
                trial_white = self.white(trial_model)
                trial_loss = float(huber(trial_white).sum())
                if np.isfinite(trial_loss) and trial_loss <= loss:
                    moved = True
                    break
                damping *= 10
            if not moved:
                break
            gain, loss = loss - trial_loss, trial_loss
            model, white, damping = trial_model, trial_white, max(damping / 10, 1e-9)
            slopes = self._slopes(model, free, white)
            if gain < _SETTLED:
                break
        return self._concluded(model, free, white, slopes.jacobian)

    def _moved(self, model: Model, free: Sequence[Free], slopes: Slopes, step: Array, damping: float) -> Model:
        return slopes.moved(moved_by(model, free, step), step, damping)

    def _concluded(self, model: Model, free: tuple[Free, ...], white: Array, jacobian: Array) -> Fit:
        weighted = jacobian * weights(white)[:, None, None]
        gradients = self.per_trial(np.einsum("kcp,kc->kp", weighted, white))
        curvatures = self.per_trial(np.einsum("kcp,kcq->kpq", weighted, jacobian))
        inner = _inside(model, free, gradients.sum(axis=0))
        total = curvatures.sum(axis=0)
        covariance = np.zeros_like(total)
        keep = np.ix_(inner, inner)
        trials, fitted = self._trials, int(inner.sum())
        if fitted:
            bread = np.linalg.pinv(total[keep])
            centred = gradients[:, inner] - gradients[:, inner].mean(axis=0)
            spare = trials / max(trials - fitted, 1)
            covariance[keep] = bread @ (centred.T @ centred) @ bread * spare
        held_out = np.empty(trials)
        first = self.predictor.tracks.first
        for i in range(trials):
            rows = slice(first[i], first[i + 1])
            step = np.zeros(len(free))
            if fitted:
                others = (total - curvatures[i])[keep]
                # without this trial the others' gradients no longer cancel: they sum to minus this one's
                step[inner] = np.linalg.pinv(others) @ (gradients[i] - gradients.sum(axis=0))[inner]
            held_out[i] = huber(white[rows] + jacobian[rows] @ step).sum()
        values = np.array([f.of(model) for f in free])
        return Fit(model, free, values, covariance, self.per_trial(huber(white)), held_out, white, jacobian)

    def chance(self, base: Fit, columns: Array) -> float:
        """`sign_flip_p` of an addition with the Jacobian ``columns`` (frames, 3, k) to a fitted model.

        What the model's own numbers could do as well is taken out of the columns first.
        """
        joint = np.concatenate([base.jacobian, columns], axis=2)
        weighted = joint * weights(base.white)[:, None, None]
        scores = self.per_trial(np.einsum("kcp,kc->kp", weighted, base.white))
        curvature = np.einsum("kcp,kcq->pq", weighted, joint)
        own = base.jacobian.shape[2]
        shared = np.linalg.pinv(curvature[:own, :own], hermitian=True) @ curvature[:own, own:]
        left = curvature[own:, own:] - curvature[own:, :own] @ shared
        return sign_flip_p(scores[:, own:] - scores[:, :own] @ shared, left)

    def evidence(self, base: Fit, added: Fit) -> Evidence:
        """What ``added`` earns over ``base``, a model with fewer effects fitted to the same problem."""
        gain, se = held_out_gain(base.held_out, added.held_out)
        known = {(f.effect, f.parameter.name) for f in base.free}
        new = [j for j, f in enumerate(added.free) if (f.effect, f.parameter.name) not in known]
        # a number with no influence here has no column
        new = [j for j in new if np.abs(added.jacobian[..., j]).max() > 0]
        chance = self.chance(base, added.jacobian[..., new]) if new and gain > 0 else 1.0
        return Evidence(gain, se, chance)

    def _slopes(self, model: Model, free: Sequence[Free], white: Array) -> Slopes:
        out = np.zeros((*white.shape, len(free)))
        for j, number in enumerate(free):
            small = _increment(number, number.of(model))
            changed = moved_by(model, free, small * np.eye(len(free))[j])
            out[..., j] = (self.white(changed) - white) / small
        return without_clocks(self, model, white, out)


def moved_by(model: Model, free: Sequence[Free], step: Array) -> Model:
    """The model with its free numbers moved, held within their bounds."""
    values = {f.effect: dict(model.values_of(f.effect)) for f in free}
    for number, change in zip(free, step, strict=True):
        p = number.parameter
        values[number.effect][p.name] = float(np.clip(number.of(model) + change, p.low, p.high))
    return model.with_values(values)


def _increment(number: Free, value: float) -> float:
    """A step for differences, turned round at the upper bound."""
    p = number.parameter
    scale = 1e-3 * abs(value) if np.isinf(p.neutral) else 1e-3 * (p.plausible[1] - p.plausible[0])
    return -scale if value + scale > p.high else scale


def _normal(jacobian: Array, white: Array) -> tuple[Array, Array]:
    weighted = jacobian * weights(white)[:, None, None]
    return np.einsum("kcp,kcq->pq", weighted, jacobian), np.einsum("kcp,kc->p", weighted, white)


def _damped_step(curvature: Array, gradient: Array, damping: float) -> Array:
    if not len(gradient):
        return np.zeros(0)
    scale = np.diag(curvature).copy()
    scale[scale <= 0] = 1.0
    solved = np.linalg.lstsq(curvature + damping * np.diag(scale), gradient, rcond=None)[0]
    return np.asarray(-solved, dtype=np.float64)


def _inside(model: Model, free: Sequence[Free], gradient: Array) -> np.ndarray:
    """Numbers that are not pressed against a bound."""
    pressed = [
        (f.of(model) <= f.parameter.low and slope > 0) or (f.of(model) >= f.parameter.high and slope < 0)
        for f, slope in zip(free, gradient, strict=True)
    ]
    return ~np.array(pressed, dtype=bool)
