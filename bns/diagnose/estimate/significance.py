"""Is one model better than another on trials that neither was fitted to? The trial is the unit, and trials are paired."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import count

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.normal_equations import NormalEquations
from bns.diagnose.estimate.pseudo_inverse import pseudo_inverse
from bns.diagnose.settings import DEFAULTS

FLIPS = DEFAULTS.estimate.flips
_SEED = DEFAULTS.estimate.flips_seed
MIN_Z = DEFAULTS.estimate.min_z


@dataclass(frozen=True)
class PairedComparison:
    """Mean difference of held-out log-likelihood a trial, its paired standard error, and the chance of such a fit by luck.

    Named as ArviZ and loo name them; `elpd_diff` is positive where the second model is the better one.
    """

    elpd_diff: float
    dse: float
    p_value: float

    @property
    def z(self) -> float:
        """The difference in standard errors."""
        return self.elpd_diff / self.dse if self.dse > 0 else 0.0


def paired_elpd_diff(before: Array, after: Array) -> tuple[float, float]:
    """Mean paired difference of held-out losses (trials,), positive where ``after`` is better, and its standard error."""
    gains = before - after
    trials = len(gains)
    mean = float(gains.mean())
    if not np.isfinite(mean):
        return float("-inf"), 0.0
    return mean, float(gains.std(ddof=1) / np.sqrt(trials)) if trials > 1 else float("inf")


def sign_flip_p(scores: Array, curvature: Array) -> float:
    """Chance that trials without the effect pull together as these do.

    ``scores`` (trials, k): each trial's gradient in the k numbers under test. Were nothing there, each trial would be as
    likely to pull the other way: the statistic g' H^-1 g of the sum g is compared with itself with the signs of
    whole trials drawn by lot. Exact whatever the scatter inside and between trials, heavy tails included.
    """
    sizes, directions = np.linalg.eigh(pseudo_inverse(curvature))
    apart = scores @ (directions * np.sqrt(np.maximum(sizes, 0.0)))  # in these the statistic is a plain sum of squares
    observed = float((apart.sum(axis=0) ** 2).sum())
    if not np.isfinite(observed) or observed <= 0:
        return 1.0
    sums = _signs(len(scores)) @ apart
    by_luck = np.einsum("fk,fk->f", sums, sums)
    return float((1 + np.count_nonzero(by_luck >= observed * (1 - 1e-9))) / (1 + FLIPS))


def jackknife_covariance(steps: Array) -> Array:
    """Covariance (p, p) of p numbers, from how much each moves when one trial is left out, ``steps`` (trials, p).

    A trial that decides much pulls the fit towards itself, so that its gradient there says too little of its scatter: with sums
    of gradients alone, intervals are too narrow where few trials decide. MacKinnon, Nielsen and Webb, Journal of Applied
    Econometrics 38(5), 2023: "Fast and reliable jackknife and bootstrap methods for cluster-robust inference" (CV3).
    """
    trials = len(steps)
    centred = steps - steps.mean(axis=0)
    out: Array = centred.T @ centred * ((trials - 1) / trials)
    return out


def chance(joint: NormalEquations, base_numbers: int) -> float:
    """`sign_flip_p` of an addition to a fitted model, whose own numbers are the first ``base_numbers`` of the normal equations.

    What these could do as well is taken out of the others first.
    """
    scores, curvature = joint.gradients, joint.curvatures.sum(axis=0)
    shared = pseudo_inverse(curvature[:base_numbers, :base_numbers]) @ curvature[:base_numbers, base_numbers:]
    left = curvature[base_numbers:, base_numbers:] - curvature[base_numbers:, :base_numbers] @ shared
    return sign_flip_p(scores[:, base_numbers:] - scores[:, :base_numbers] @ shared, left)


@lru_cache
def fewest_trials(level: float) -> int:
    """From fewer no effect can be taken, however large it is: that all trials pull the same way is no rarer by luck than this."""
    return next(n for n in count(2) if sign_flip_p(np.ones((n, 1)), np.eye(1)) < level)


@lru_cache(maxsize=1)
def _signs(trials: int) -> Array:
    """Lots of +1 and -1, (flips, trials); always the same, so kept: drawing them costs more than using them."""
    return np.random.default_rng(_SEED).choice([-1.0, 1.0], size=(FLIPS, trials))
