"""Fit the numbers of a model's effects to tracks, and say how well they are known.

The unit of evidence is the trial: frames of one trial share what happened in it. Standard errors come from the scatter of
the trials' gradients (the sandwich estimator, clustered by trial); what a trial would lose if it had not been fitted
comes from one Newton step without it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.noise import Filter, huber
from bns.diagnose.estimate.normal_equations import Normal, normal, normal_by_trial, stepped
from bns.diagnose.estimate.parameters import Free, increment, inside, moved_by
from bns.diagnose.estimate.significance import Evidence, held_out_gain, sign_flip_p
from bns.diagnose.estimate.trial_clocks import Slopes, with_clocks_begun, without_clocks
from bns.diagnose.predict.base import Predictor
from bns.physics.model import Model

_ROUNDS = 25
_SETTLED = 1e-2
"""A step that lowers the loss by less than this ends the search: numbers are then within a tenth of their standard error."""
_TRUSTED = 0.75
"""Slopes serve for another step if the last one earned this share of what they foretold."""


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

    @property
    def slopes(self) -> dict[Free, Array]:
        """Slopes of the innovations along every number, (frames, 3) each."""
        return dict(zip(self.free, np.moveaxis(self.jacobian, 2, 0), strict=True))

    def se(self, index: int) -> float:
        """Standard error of a number."""
        return float(np.sqrt(max(self.covariance[index, index], 0.0)))

    def interval(self, index: int, share: float = 0.95) -> tuple[float, float]:
        """Student's interval with as many degrees of freedom as there are trials to spare."""
        freedom = max(len(self.losses) - len(self.free), 1)
        half = float(student.ppf((1 + share) / 2, freedom)) * self.se(index)
        return float(self.values[index] - half), float(self.values[index] + half)


@dataclass(frozen=True)
class Begun:
    """Where a fit may begin: a model, its loss, and slopes of its numbers nearby, (frames, 3) each."""

    model: Model
    loss: float
    slopes: Mapping[Free, Array]


@dataclass(frozen=True)
class _Point:
    """A model, its whitened innovations (frames, 3) and its loss."""

    model: Model
    white: Array
    loss: float


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

    def stepped(self, model: Model, base: Fit) -> Begun:
        """One undamped step of least squares in all numbers, with the slopes of ``base`` for those that it has too."""
        free, at = self.free(model), self._point(model)
        slopes = self._slopes(at, free, base.slopes)
        there = self._moved(model, free, slopes, _damped_step(*normal(slopes.jacobian, at.white), 1e-9), 0.0)
        return Begun(there, self.loss(there), dict(zip(free, np.moveaxis(slopes.jacobian, 2, 0), strict=True)))

    def fit(self, model: Model, rounds: int | None = None, known: Mapping[Free, Array] | None = None) -> Fit:
        """Levenberg-Marquardt from the values the model has, within the bounds of every number; ``rounds`` 0 keeps them.

        Slopes serve for further steps while the loss falls nearly as they foretell, those ``known`` from nearby for the first.
        """
        model = with_clocks_begun(self, model, self._trials)
        free, at, damping = self.free(model), self._point(model), 1e-3
        slopes, fresh = self._slopes(at, free, known), not known
        for _ in range(_ROUNDS if rounds is None and (free or model.differing) else 0):
            pull = normal(slopes.jacobian, at.white)
            foretold = _foretold(_damped_step(*pull, damping), *pull)
            done = foretold < _SETTLED and model.differing is None
            found, gain = None if done else self._lower(at, free, slopes, pull, damping), 0.0
            if found is not None:
                gain, at, damping = at.loss - found[0].loss, *found
            if gain < _SETTLED and fresh:
                fresh = found is None
                break
            fresh = found is None or model.differing is not None or gain < _TRUSTED * foretold
            if fresh:
                slopes = self._slopes(at, free)
        if not fresh and rounds is None:
            slopes = self._slopes(at, free)
        return self._concluded(at.model, free, at.white, slopes.jacobian)

    def _point(self, model: Model) -> _Point:
        white = self.white(model)
        return _Point(model, white, float(huber(white).sum()))

    def _lower(
        self, at: _Point, free: Sequence[Free], slopes: Slopes, pull: tuple[Array, Array], damping: float
    ) -> tuple[_Point, float] | None:
        """Where a step leads that does not raise the loss, and the damping for the next; None if there is none."""
        for _ in range(8):
            step = _damped_step(*pull, damping)
            there = self._point(self._moved(at.model, free, slopes, step, damping))
            if np.isfinite(there.loss) and there.loss <= at.loss:
                return there, max(damping / 10, 1e-9)
            damping *= 10
        return None

    def _moved(self, model: Model, free: Sequence[Free], slopes: Slopes, step: Array, damping: float) -> Model:
        return slopes.moved(moved_by(model, free, step), step, damping)

    def _concluded(self, model: Model, free: tuple[Free, ...], white: Array, jacobian: Array) -> Fit:
        by_trial = self.normal(jacobian, white)
        gradients, curvatures = by_trial.gradients, by_trial.curvatures
        inner = inside(model, free, gradients.sum(axis=0))
        total = curvatures.sum(axis=0)
        covariance = np.zeros_like(total)
        keep = np.ix_(inner, inner)
        trials, fitted = self._trials, int(inner.sum())
        if fitted:
            bread = np.linalg.pinv(total[keep])
            centred = gradients[:, inner] - gradients[:, inner].mean(axis=0)
            spare = trials / max(trials - fitted, 1)
            covariance[keep] = bread @ (centred.T @ centred) @ bread * spare
        steps = np.zeros((trials, len(free)))
        if fitted:
            others = (total - curvatures)[:, inner][:, :, inner]
            # without this trial the others' gradients no longer cancel: they sum to minus this one's
            pulls = (gradients - gradients.sum(axis=0))[:, inner]
            steps[:, inner] = (np.linalg.pinv(others) @ pulls[..., None])[..., 0]
        held_out = self.per_trial(huber(stepped(self.predictor.tracks.first, jacobian, white, steps)))
        values = np.array([f.of(model) for f in free])
        return Fit(model, free, values, covariance, self.per_trial(huber(white)), held_out, white, jacobian)

    def normal(self, jacobian: Array, white: Array) -> Normal:
        """The normal equations of every trial."""
        return normal_by_trial(self.predictor.tracks.first, jacobian, white)

    def evidence(self, base: Fit, added: Fit) -> Evidence:
        """What ``added`` earns over ``base``, a model with fewer effects fitted to the same problem."""
        gain, se = held_out_gain(base.held_out, added.held_out)
        known = {(f.effect, f.parameter.name) for f in base.free}
        new = [j for j, f in enumerate(added.free) if (f.effect, f.parameter.name) not in known]
        # a number with no influence here has no column
        new = [j for j in new if np.abs(added.jacobian[..., j]).max() > 0]
        if not new or gain <= 0:
            return Evidence(gain, se, 1.0)
        joint = np.concatenate([base.jacobian, added.jacobian[..., new]], axis=2)
        return Evidence(gain, se, chance(self.normal(joint, base.white), base.jacobian.shape[2]))

    def _slopes(self, at: _Point, free: Sequence[Free], known: Mapping[Free, Array] | None = None) -> Slopes:
        """By differences, but for numbers whose slopes are known; clocks of trials shift those, and all are worked out anew."""
        known = known if known and at.model.differing is None else {}
        out = np.zeros((*at.white.shape, len(free)))
        for j, number in enumerate(free):
            if number in known:
                out[..., j] = known[number]
                continue
            small = increment(number, number.of(at.model))
            changed = moved_by(at.model, free, small * np.eye(len(free))[j])
            out[..., j] = (self.white(changed) - at.white) / small
        return without_clocks(self, at.model, at.white, out)


def chance(joint: Normal, own: int) -> float:
    """`sign_flip_p` of an addition to a fitted model, whose own numbers are the first ``own`` of the normal equations.

    What these could do as well is taken out of the others first.
    """
    scores, curvature = joint.gradients, joint.curvatures.sum(axis=0)
    shared = np.linalg.pinv(curvature[:own, :own], hermitian=True) @ curvature[:own, own:]
    left = curvature[own:, own:] - curvature[own:, :own] @ shared
    return sign_flip_p(scores[:, own:] - scores[:, :own] @ shared, left)


def _foretold(step: Array, curvature: Array, gradient: Array) -> float:
    """By how much a step lowers the loss, by the slopes."""
    return float(-(gradient @ step) - step @ curvature @ step / 2)


def _damped_step(curvature: Array, gradient: Array, damping: float) -> Array:
    if not len(gradient):
        return np.zeros(0)
    scale = np.diag(curvature).copy()
    scale[scale <= 0] = 1.0
    solved = np.linalg.lstsq(curvature + damping * np.diag(scale), gradient, rcond=None)[0]
    return np.asarray(-solved, dtype=np.float64)
