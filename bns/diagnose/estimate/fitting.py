"""Fit the numbers of a model's effects to tracks, and say how well they are known.

The unit of evidence is the trial: frames of one trial share what happened in it. What the fit would be without a trial
comes from one Newton step without it: standard errors (the jackknife over trials), and what the trial loses if it is held out.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.chords import chords, reaching
from bns.diagnose.estimate.clocks.trial_clocks import ReducedJacobian, eliminate_clocks, with_initial_clocks
from bns.diagnose.estimate.fit import Fit, StartingPoint
from bns.diagnose.estimate.look_around import lower_place
from bns.diagnose.estimate.noise import Whitening, gathered, huber
from bns.diagnose.estimate.normal_equations import (
    NormalEquations,
    damped_step,
    innovations_after,
    normal_equations,
    normal_equations_by_trial,
    predicted_decrease_of,
)
from bns.diagnose.estimate.parameters import FreeParameter, active_mask, increments, moved_by
from bns.diagnose.estimate.pseudo_inverse import pseudo_inverse
from bns.diagnose.estimate.significance import PairedComparison, chance, jackknife_covariance, paired_elpd_diff
from bns.diagnose.predict.base import Predictor, Steps
from bns.diagnose.settings import DEFAULTS
from bns.engine.pose_filter import TRUSTED
from bns.errors import EffectError, ModelError
from bns.physics.model import Model

_LATELY = 16
"""Models whose innovations are remembered, per problem: more are not asked for again."""
_ROUNDS = DEFAULTS.estimate.fit_rounds
_SETTLED = DEFAULTS.estimate.fit_settled
_TRUSTED = DEFAULTS.estimate.fit_trusted
_LOOKS = DEFAULTS.estimate.look_rounds
_RULED = DEFAULTS.estimate.slope_ruled
_SHORTER = DEFAULTS.estimate.slope_shorter


@dataclass(frozen=True)
class _Point:
    """A model, its whitened innovations (frames, 3) and its loss."""

    model: Model
    whitened: Array
    loss: float


class Problem:
    """Tracks, a filter that follows them, and which numbers may be fitted."""

    def __init__(self, predictor: Predictor, pose_filter: Whitening, counted: Array | None = None) -> None:
        """``counted`` (frames,): what each frame counts; 1 for all where it is not given."""
        self.predictor = predictor
        self.pose_filter = pose_filter
        self._counted = None if counted is None else np.sqrt(counted)[:, None]
        tracks = predictor.tracks
        self._trial, self._trials = tracks.trial, len(tracks)
        self._lately: OrderedDict[tuple[Any, ...], tuple[Model, Array]] = OrderedDict()
        self._lock = threading.Lock()

    def __getstate__(self) -> dict[str, Any]:
        return {k: v for k, v in self.__dict__.items() if k not in {"_lately", "_lock"}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _lately=OrderedDict(), _lock=threading.Lock())

    def whitened(self, model: Model) -> Array:
        """Whitened innovations under a model, (frames, 3); not to be changed: of models asked for lately it is the same array.

        A fit begins where the choice of its start ended, and ends where its last step led: a fifth of all questions come twice.
        """
        key = (model.wheelbase_m, *((id(a.effect), a.values, a.trial_values) for a in model.effects))
        with self._lock:
            known = self._lately.get(key)
        if known is not None:
            return known[1]
        whitened = self._worked_out(model)
        with self._lock:
            self._lately[key] = (model, whitened)  # the model keeps its effects, and so their ids, alive
            while len(self._lately) > _LATELY:
                self._lately.popitem(last=False)
        return whitened

    def _worked_out(self, model: Model) -> Array:
        return self.whitened_steps(self.predictor.steps(model))

    def whitened_steps(self, steps: Steps) -> Array:
        """Whitened innovations under steps that no model of the catalogue may predict, (frames, 3)."""
        whitened = self.pose_filter.whitened(self.predictor.tracks, steps)
        if self.predictor.luck is not None:
            whitened = gathered(whitened)
        return whitened if self._counted is None else whitened * self._counted

    @property
    def frame_trial(self) -> NDArray[np.int64]:
        """The trial of every frame, (frames,)."""
        return self._trial

    def per_trial(self, values: Array) -> Array:
        """Sums over the frames of each trial; (trials, ...)."""
        return np.add.reduceat(values, self.predictor.tracks.first[:-1], axis=0)

    def loss(self, model: Model) -> float:
        """Robust loss of all frames."""
        total = float(huber(self.whitened(model)).sum())
        return total if np.isfinite(total) else np.inf

    def free(self, model: Model) -> tuple[FreeParameter, ...]:
        """The numbers of the model's effects that all trials share and these tracks can speak of."""
        columns = self.predictor.tracks.extra
        return tuple(
            FreeParameter(active.effect.name, p)
            for active in model.effects
            if not active.per_trial
            for p in active.effect.parameters
            if not (p.column and p.column not in columns) and not (p.instead_of and p.instead_of in columns)
        )

    def gauss_newton_step(self, model: Model, base: Fit) -> StartingPoint:
        """One undamped step of least squares in all numbers, with the Jacobian of ``base`` for those that it has too."""
        free, at = self.free(model), self._point(model)
        reduced = self._jacobian(at, free, base.jacobian_by_parameter)
        equations = normal_equations(reduced.jacobian, at.whitened)
        step = damped_step(*equations, 1e-9)
        there = self._moved(model, free, reduced, step, 0.0)
        promised = at.loss - predicted_decrease_of(step, *equations)
        known = dict(zip(free, np.moveaxis(reduced.jacobian, 2, 0), strict=True))
        return StartingPoint(there, self.loss(there), promised, known)

    def fit(self, model: Model, rounds: int | None = None, nearby: Mapping[FreeParameter, Array] | None = None) -> Fit:
        """Levenberg-Marquardt from the values the model has, within the bounds of every number; ``rounds`` 0 keeps them.

        The Jacobian serves for further steps while the loss falls nearly as predicted; columns ``nearby`` serve for the first.
        """
        model = with_initial_clocks(self, model, self._trials)
        free, at = self.free(model), self._point(model)
        most = _ROUNDS if rounds is None and (free or model.per_trial_effect) else 0
        at, reduced, fresh = self._descended(at, free, nearby, most)
        rough = self.predictor.luck is not None
        for _ in range(_LOOKS if rough and rounds is None else 0):
            there = lower_place(self.loss, at.model, free, at.loss)
            if there is None:
                break
            at, reduced, fresh = self._descended(self._point(there), free, None, most)
        if rounds is None and (rough or not fresh):
            reduced = self._jacobian(at, free, wide=rough)
        return self._concluded(at.model, free, at.whitened, reduced.jacobian)

    def fitted_at(self, model: Model) -> Fit:
        """The fit of which these are the numbers, whatever their loss."""
        at, free = self._point(model), self.free(model)
        reduced = self._jacobian(at, free, wide=self.predictor.luck is not None)
        return self._concluded(model, free, at.whitened, reduced.jacobian)

    def _descended(
        self, at: _Point, free: Sequence[FreeParameter], nearby: Mapping[FreeParameter, Array] | None, most: int
    ) -> tuple[_Point, ReducedJacobian, bool]:
        """Where so many steps end at most, the last Jacobian, and whether that is the one of the end."""
        damping = 1e-3
        reduced, fresh = self._jacobian(at, free, nearby), not nearby
        for _ in range(most):
            equations = normal_equations(reduced.jacobian, at.whitened)
            predicted_decrease = predicted_decrease_of(damped_step(*equations, damping), *equations)
            done = predicted_decrease < _SETTLED and at.model.per_trial_effect is None
            lower, gain = None if done else self._lower(at, free, reduced, equations, damping), 0.0
            if lower is not None:
                gain, at, damping = at.loss - lower[0].loss, *lower
            if gain < _SETTLED and fresh:
                fresh = lower is None
                break
            fresh = lower is None or at.model.per_trial_effect is not None or gain < _TRUSTED * predicted_decrease
            if fresh:
                reduced = self._jacobian(at, free)
        return at, reduced, fresh

    def _point(self, model: Model) -> _Point:
        whitened = self.whitened(model)
        return _Point(model, whitened, float(huber(whitened).sum()))

    def _lower(
        self,
        at: _Point,
        free: Sequence[FreeParameter],
        reduced: ReducedJacobian,
        equations: tuple[Array, Array],
        damping: float,
    ) -> tuple[_Point, float] | None:
        """Where a step leads that does not raise the loss, and the damping for the next; None if there is none."""
        for _ in range(8):
            step = damped_step(*equations, damping)
            there = self._stepped(at, free, reduced, step, damping)
            if there is not None and np.isfinite(there.loss) and there.loss <= at.loss:
                return there, max(damping / 10, 1e-9)
            damping *= 10
        return None

    def _stepped(
        self, at: _Point, free: Sequence[FreeParameter], reduced: ReducedJacobian, step: Array, damping: float
    ) -> _Point | None:
        try:
            return self._point(self._moved(at.model, free, reduced, step, damping))
        except EffectError:
            raise
        except ModelError:  # a formula has no value there
            return None

    def _moved(
        self, model: Model, free: Sequence[FreeParameter], reduced: ReducedJacobian, step: Array, damping: float
    ) -> Model:
        return reduced.moved(moved_by(model, free, step), step, damping)

    def _concluded(self, model: Model, free: tuple[FreeParameter, ...], whitened: Array, jacobian: Array) -> Fit:
        by_trial = self.normal_equations(jacobian, whitened)
        gradients, curvatures = by_trial.gradients, by_trial.curvatures
        active = active_mask(model, free, gradients.sum(axis=0))
        total = curvatures.sum(axis=0)
        covariance, steps = np.zeros_like(total), np.zeros((self._trials, len(free)))
        if active.any():
            others = (total - curvatures)[:, active][:, :, active]
            # without this trial the others' gradients no longer cancel: they sum to minus this one's
            of_others = (gradients - gradients.sum(axis=0))[:, active]
            steps[:, active] = (pseudo_inverse(others) @ of_others[..., None])[..., 0]
            covariance[np.ix_(active, active)] = jackknife_covariance(steps[:, active])
        held_out = self.per_trial(huber(innovations_after(self.predictor.tracks.first, jacobian, whitened, steps)))
        values = np.array([f.of(model) for f in free])
        return Fit(model, free, values, covariance, self.per_trial(huber(whitened)), held_out, whitened, jacobian)

    def normal_equations(self, jacobian: Array, whitened: Array) -> NormalEquations:
        """The normal equations of every trial."""
        return normal_equations_by_trial(self.predictor.tracks.first, jacobian, whitened)

    def paired_comparison(self, base: Fit, added: Fit) -> PairedComparison:
        """What ``added`` earns over ``base``, a model with fewer effects fitted to the same problem."""
        elpd_diff, dse = paired_elpd_diff(base.held_out, added.held_out)
        known = {(f.effect, f.parameter.name) for f in base.free}
        new = [j for j, f in enumerate(added.free) if (f.effect, f.parameter.name) not in known]
        # the whole way, since between two steps of a response the slope is 0; without influence anywhere nothing is earned
        ways = chords(self.whitened, added, new) if new and elpd_diff > 0 else np.zeros((0, 3, 0))
        if not ways.any():
            return PairedComparison(elpd_diff, dse, 1.0)
        columns = reaching(added.whitened - base.whitened, ways)
        joint = np.concatenate([base.jacobian, columns], axis=2)
        return PairedComparison(
            elpd_diff, dse, chance(self.normal_equations(joint, base.whitened), base.jacobian.shape[2])
        )

    def _jacobian(
        self,
        at: _Point,
        free: Sequence[FreeParameter],
        nearby: Mapping[FreeParameter, Array] | None = None,
        wide: bool = False,
    ) -> ReducedJacobian:
        """By differences, but for numbers whose columns are known; clocks of trials shift those, so all are computed again.

        ``wide``: over a good part of what is plausible, to the side where less changes. The response of a body to a servo's
        strength has steps, and the slope within one says that a number is known far better than it is.
        """
        nearby = nearby if nearby and at.model.per_trial_effect is None else {}
        out = np.zeros((*at.whitened.shape, len(free)))
        for j, number in enumerate(free):
            if number in nearby:
                out[..., j] = nearby[number]
                continue
            if np.isinf(number.of(at.model)):  # a limit that nothing reaches: a small change does nothing
                continue
            slopes = [self._slope(at, free, j, by) for by in increments(number, number.of(at.model), wide)]
            out[..., j] = min(slopes, key=lambda slope: float((slope**2).sum()))
        return eliminate_clocks(self, at.model, at.whitened, out)

    def _slope(self, at: _Point, free: Sequence[FreeParameter], j: int, by: float) -> Array:
        """A column of the Jacobian, (frames, 3). With a jump in it, or ruled by a trial: each trial's slope to the flatter side.

        Far from the truth the filter is reset in some trials (`innovations`), and a change of the number by a thousandth can
        move where: a jump by more than the filter trusts any pose, whose slope says that these trials alone know the number.
        Bodies, which have no such filter, have wide slopes instead; where a number has steps of its own, they are no such jumps.
        The change of a number of any size is shortened until it moves no pose by as much: what multiplies 1000 s squared is tiny.
        """
        slope, p = self._difference(at, free, j, by), free[j].parameter
        for _ in range(_SHORTER if p.of_any_size else 0):
            if float(np.abs(slope * by).max(initial=0.0)) <= TRUSTED:
                break
            by /= 10
            slope = self._difference(at, free, j, by)
        if self.predictor.luck is not None:
            return slope
        steepness, other = self.per_trial((slope**2).sum(axis=1)), free[j].of(at.model) - by
        jumps = not p.jagged and float(np.abs(slope * by).max(initial=0.0)) > TRUSTED
        if not (jumps or steepness.max() > _RULED * steepness.sum()) or not p.low <= other <= p.high:
            return slope
        back = self._difference(at, free, j, -by)
        flatter = self.per_trial((back**2).sum(axis=1)) < steepness
        return np.where(flatter[self._trial][:, None], back, slope)

    def _difference(self, at: _Point, free: Sequence[FreeParameter], j: int, by: float) -> Array:
        changed = moved_by(at.model, free, by * np.eye(len(free))[j])
        slope: Array = (self.whitened(changed) - at.whitened) / by
        return slope
