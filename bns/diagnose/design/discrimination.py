"""How far planned trials drive two fitted explanations apart, when each may adjust its numbers to what will be seen.

If explanation A holds with numbers a (known from the old tracks up to their covariance C), a trial shows B the whitened error
d + J_A (a - a0), d = white_B - white_A at the fitted numbers, up to unit noise. B then moves its numbers within what the old
tracks allow (curvature H_B), and so does A (H_A). Twice the expected gain in log-likelihood of A over B, a integrated out, is

    d'd - g_B' K_B g_B  +  tr C (G_AA K_A G_AA - G_AB K_B G_BA),   K = (H + G)^-1,   g_B = sum J_B'd,   G = sum J'J:

Hunter and Reiner's criterion (Technometrics 7, 1965) with Box and Hill's regard for what is not known of the numbers
(Technometrics 9, 1967); without the old tracks it is Atkinson and Fedorov's T-optimality, made linear (Biometrika 62, 1975). It
vanishes where B can follow A. It is taken with either explanation as the true one, and both count.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from bns.diagnose.data.tracks import Array
from bns.diagnose.design.competing_models import CompetingModel
from bns.diagnose.design.planned import delays_of, noise_free_predictor, planned_tracks
from bns.diagnose.design.sequences import Arena, Sequences
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import huber
from bns.diagnose.estimate.problem import problem_with_noise
from bns.diagnose.estimate.pseudo_inverse import pseudo_inverse
from bns.physics.model import Model

Pair = tuple[int, int]


@dataclass(frozen=True)
class Discrimination:
    """Sums of each planned trial for one pair in one direction: d'd (trials,), J'd (trials, p), J'J (trials, p, p).

    J = (J_B, J_A), the first ``split`` columns B's. ``prior`` (p, p): H of both; ``spread``: C. ``measured`` (trials,): how many
    numbers each trial measures.
    """

    squared: Array
    gradient: Array
    information: Array
    prior: Array
    spread: Array
    split: int
    measured: Array

    def only(self, chosen: NDArray[np.int64]) -> Discrimination:
        """Some of the trials."""
        return replace(
            self,
            squared=self.squared[chosen],
            gradient=self.gradient[chosen],
            information=self.information[chosen],
            measured=self.measured[chosen],
        )

    def joined(self, other: Discrimination) -> Discrimination:
        """These trials, then the other's."""
        return replace(
            self,
            squared=np.concatenate([self.squared, other.squared]),
            gradient=np.concatenate([self.gradient, other.gradient]),
            information=np.concatenate([self.information, other.information]),
            measured=np.concatenate([self.measured, other.measured]),
        )

    def of(self, squared: Array, gradient: Array, information: Array) -> Array:
        """The discrimination of sums over sets of trials, (sets,); the sums are (sets,), (sets, p), (sets, p, p)."""
        k = self.split
        step, follow, own = self._answers(gradient, information)
        known = np.einsum("sij,sjk->sik", information[:, k:, k:], own) - np.einsum(
            "sij,sjk->sik", information[:, k:, :k], follow
        )
        gained = squared - np.einsum("sp,sp->s", gradient[:, :k], step) + np.einsum("ij,sji->s", self.spread, known)
        return np.maximum(gained, 0.0)

    def total(self) -> float:
        """The discrimination of all the trials together."""
        return float(self.of(*(v.sum(axis=0)[None] for v in (self.squared, self.gradient, self.information)))[0])

    def rms(self) -> float:
        """What all the trials together leave between the two once both have adjusted: root mean square over all that is measured,
        in standard deviations of its noise."""
        return float(np.sqrt(self.total() / max(float(self.measured.sum()), 1.0)))

    def each(self) -> Array:
        """What each trial has of `total`, all having adjusted to all of them, (trials,)."""
        k = self.split
        (step,), (follow,), (own,) = self._answers(self.gradient.sum(axis=0)[None], self.information.sum(axis=0)[None])
        left = (
            self.squared
            - 2 * self.gradient[:, :k] @ step
            + np.einsum("tpq,p,q->t", self.information[:, :k, :k], step, step)
        )
        wrong = np.concatenate([-follow, np.eye(len(self.spread))])  # what B cannot follow of a change of A's numbers
        rest = np.eye(len(self.spread)) - own
        for answer, sign, part in ((wrong, 1.0, self.information), (rest, -1.0, self.information[:, k:, k:])):
            left = left + sign * np.einsum("ij,kj,tkl,li->t", self.spread, answer, part, answer)
        return np.maximum(left, 0.0)

    def _answers(self, gradient: Array, information: Array) -> tuple[Array, Array, Array]:
        """K_B g_B (sets, b), K_B G_BA (sets, b, a), K_A G_AA (sets, a, a)."""
        k = self.split
        right = np.concatenate([gradient[:, :k, None], information[:, :k, k:]], axis=2)
        of_b = _solved(self.prior[:k, :k] + information[:, :k, :k], right)
        return of_b[..., 0], of_b[..., 1:], _solved(self.prior[k:, k:] + information[:, k:, k:], information[:, k:, k:])


def _solved(matrix: Array, right: Array) -> Array:
    """Solutions of symmetric systems, (sets, p, columns), whose numbers may be of any size."""
    if not matrix.shape[-1]:
        return np.zeros_like(right)
    scale = np.sqrt(np.maximum(np.einsum("spp->sp", matrix), 1e-300))[..., None]
    scaled = matrix / scale / scale.swapaxes(1, 2) + 1e-10 * np.eye(matrix.shape[-1])
    return np.asarray(np.linalg.solve(scaled, right / scale) / scale)


@dataclass(frozen=True)
class ExperimentSetup:
    """Where and how a plan would be carried out and seen, and which pairs of models it is about."""

    problem: Problem
    arena: Arena
    frame_s: float | None
    session_s: Callable[[Sequences], Array]
    pairs: tuple[Pair, ...]


def discriminations(
    competing_models: Sequence[CompetingModel], plan: Sequences, setup: ExperimentSetup
) -> tuple[dict[Pair, tuple[Discrimination, Discrimination]], NDArray[np.bool_]]:
    """Both directions of pairs of models over a plan's trials; and which trials stay inside the arena under all models."""
    tracks = planned_tracks(plan, setup.arena.start, setup.frame_s, setup.session_s(plan))
    noise = setup.problem.pose_filter.noise
    errors: list[list[tuple[Array, Array]]] = []
    inside = np.ones(len(plan), dtype=bool)
    problems = []
    delays_s = delays_of(competitor.fit.model for competitor in competing_models)
    for true in competing_models:
        predictor = noise_free_predictor(true.fit.model, tracks, delays_s)
        steps = predictor.steps(true.fit.model)
        problem = problem_with_noise(predictor, steps, noise)
        problems.append(problem)
        held = setup.arena.holds(predictor.tracks.pose[:, 0], predictor.tracks.pose[:, 1], 0.0)
        inside &= problem.per_trial((~held).astype(float)) == 0
        errors.append([whitened_errors(problem, competitor.fit.model) for competitor in competing_models])
    result = {
        (a, b): (
            _sums(problems[a], errors[a][b], errors[a][a], competing_models[b].fit, competing_models[a].fit),
            _sums(problems[b], errors[b][a], errors[b][b], competing_models[a].fit, competing_models[b].fit),
        )
        for a, b in setup.pairs
    }
    return result, inside


def whitened_errors(problem: Problem, model: Model) -> tuple[Array, Array]:
    """Whitened errors (frames, 3) and their Jacobian (frames, 3, p) of a model as it is."""
    fit = problem.fit(model, rounds=0)
    return fit.whitened, fit.jacobian


def curvature_of(fit: Fit) -> Array:
    """What the tracks of a fit know of its numbers, (p, p): the inverse of their covariance.

    The sandwich covariance, so that what trials of one session share is not counted as knowledge; numbers pressed
    against a bound (no variance) are taken as fixed.
    """
    size = np.diag(fit.covariance)
    known = size > 0
    out = np.zeros_like(fit.covariance)
    keep = np.ix_(known, known)
    out[keep] = pseudo_inverse(fit.covariance[keep])
    loose = np.einsum("kcp,kcp->p", fit.jacobian, fit.jacobian)
    out[~known, ~known] = 1e9 * np.maximum(loose[~known], 1.0)
    return out


def _sums(
    problem: Problem, other: tuple[Array, Array], true: tuple[Array, Array], of_other: Fit, of_true: Fit
) -> Discrimination:
    error = other[0] - true[0]
    jacobian = np.concatenate([other[1], true[1]], axis=2)
    equations = problem.normal_equations(jacobian, error)
    return Discrimination(
        problem.per_trial(2 * huber(error)),  # the diagnosis counts a large error linearly, and so must who foresees it
        equations.gradients,
        equations.curvatures,
        block_diag(curvature_of(of_other), curvature_of(of_true)),
        of_true.covariance,
        len(of_other.free),
        problem.per_trial(np.full(len(error), float(error.shape[1]))),
    )
