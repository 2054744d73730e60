"""How far planned trials drive two fitted explanations apart, when each may adjust its numbers to what will be seen.

If explanation A holds, a trial shows B the whitened error d = white_B - white_A on A's path, up to unit noise. B answers
with its numbers, and A's own are known only so well: both move within what the old tracks allow. What is left is

    sum d'd - g' (H + sum J'J)^-1 g,   J = (J_B, -J_A),  g = sum J'd,  H = diag(H_B, H_A),

twice the expected gain in log-likelihood of the one over the other: Hunter and Reiner's criterion (Technometrics 7, 1965) with
the predictive covariance of Box and Hill (Technometrics 9, 1967), the linear form of Atkinson and Fedorov's T-optimality
(Biometrika 62, 1975). It is taken with either explanation as the true one, and the mean of both counts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.fit import Fit, Problem
from bns.diagnose.noise import filter_for, huber, weights
from bns.diagnose.planned import foreseen, planned_tracks
from bns.diagnose.rivals import Rival
from bns.diagnose.sequences import Arena, Sequences
from bns.diagnose.tracks import Array
from bns.physics.model import Model

Pair = tuple[int, int]


@dataclass(frozen=True)
class Apart:
    """Sums of each planned trial for one pair in one direction: s = d'd (trials,), g (trials, p), J'J (trials, p, p).

    ``prior`` (p, p): H.
    """

    square: Array
    pull: Array
    give: Array
    prior: Array

    def only(self, chosen: NDArray[np.int64]) -> Apart:
        """Some of the trials."""
        return Apart(self.square[chosen], self.pull[chosen], self.give[chosen], self.prior)

    def of(self, square: float, pull: Array, give: Array) -> float:
        """The separation that sums over trials come to."""
        solved = np.linalg.lstsq(self.prior + give, pull, rcond=None)[0] if len(pull) else pull
        return max(float(square - pull @ solved), 0.0)

    def total(self) -> float:
        """The separation of all the trials together."""
        return self.of(float(self.square.sum()), self.pull.sum(axis=0), self.give.sum(axis=0))

    def each(self) -> Array:
        """What each trial adds to `total` where all of them shared its adjustment, (trials,); summing to it but for H."""
        if not self.pull.shape[1]:
            return self.square
        step = np.linalg.lstsq(self.prior + self.give.sum(axis=0), self.pull.sum(axis=0), rcond=None)[0]
        left = self.square - 2 * self.pull @ step + np.einsum("tpq,p,q->t", self.give, step, step)
        return np.maximum(left, 0.0)


@dataclass(frozen=True)
class Stage:
    """Where and how a plan would be carried out and seen, and which pairs of rivals it is about."""

    problem: Problem
    arena: Arena
    frame_s: float | None
    session_s: Callable[[Sequences], Array]
    pairs: tuple[Pair, ...]


def apart(
    rivals: Sequence[Rival], plan: Sequences, stage: Stage
) -> tuple[dict[Pair, tuple[Apart, Apart]], NDArray[np.bool_]]:
    """Both directions of pairs of rivals over a plan's trials; and which trials stay inside the arena under all rivals."""
    tracks = planned_tracks(plan, stage.arena.start, stage.frame_s, stage.session_s(plan))
    noise = stage.problem.following.noise
    seen: list[list[tuple[Array, Array]]] = []
    inside = np.ones(len(plan), dtype=bool)
    problems = []
    for true in rivals:
        predictor = foreseen(true.fit.model, tracks)
        steps = predictor.steps(true.fit.model)
        problem = Problem(predictor, filter_for(predictor, steps, noise))
        problems.append(problem)
        held = stage.arena.holds(predictor.tracks.pose[:, 0], predictor.tracks.pose[:, 1], 0.0)
        inside &= problem.per_trial((~held).astype(float)) == 0
        seen.append([whitened(problem, rival.fit.model) for rival in rivals])
    priors = [curvature_of(rival.fit) for rival in rivals]
    found = {
        (a, b): (
            _sums(problems[a], seen[a][b], seen[a][a], priors[b], priors[a]),
            _sums(problems[b], seen[b][a], seen[b][b], priors[a], priors[b]),
        )
        for a, b in stage.pairs
    }
    return found, inside


def whitened(problem: Problem, model: Model) -> tuple[Array, Array]:
    """Whitened errors (frames, 3) and their Jacobian (frames, 3, p) of a model as it is."""
    fit = problem.fit(model, rounds=0)
    return fit.white, fit.jacobian


def curvature_of(fit: Fit) -> Array:
    """What the tracks of a fit know of its numbers, (p, p): the inverse of their covariance.

    The sandwich covariance, so that what trials of one session share is not counted as knowledge; numbers pressed
    against a bound (no variance) are taken as fixed.
    """
    size = np.diag(fit.covariance)
    known = size > 0
    out = np.zeros_like(fit.covariance)
    keep = np.ix_(known, known)
    out[keep] = np.linalg.pinv(fit.covariance[keep], hermitian=True)
    loose = np.einsum("kcp,kcp->p", fit.jacobian, fit.jacobian)
    out[~known, ~known] = 1e9 * np.maximum(loose[~known], 1.0)
    return out


def _sums(problem: Problem, other: tuple[Array, Array], true: tuple[Array, Array], prior: Array, own: Array) -> Apart:
    error = other[0] - true[0]
    jacobian = np.concatenate([other[1], -true[1]], axis=2)
    weight = weights(error)[:, None]
    size = jacobian.shape[2]
    both = np.zeros((size, size))
    split = len(prior)
    both[:split, :split], both[split:, split:] = prior, own
    weighted = jacobian * weight[..., None]
    return Apart(
        problem.per_trial(2 * huber(error)),  # the diagnosis counts a large error linearly, and so must who foresees it
        problem.per_trial(np.einsum("kcp,kc->kp", weighted, error)),
        problem.per_trial(np.einsum("kcp,kcq->kpq", weighted, jacobian)),
        both,
    )


def separation(both: tuple[Apart, Apart]) -> float:
    """By all trials, the mean of both directions."""
    return (both[0].total() + both[1].total()) / 2
