"""Which accepted effects stand beside a flexible term, and which only imitate what no listed effect explains.

Where structure is left, a free curve (or a field over the floor) along the variable that shows it is fitted together with the
model, and every accepted effect is judged again: with the curve in both models, does the effect still earn anything on trials
held out? An effect that acts everywhere alike (a gain) can be built from a free curve, too; it is judged beside a curve whose
mean is zero, and must then be needed by most of the trials, not by those few that crossed the place.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import binom

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit, Problem
from bns.diagnose.estimate.significance import MIN_Z, paired_elpd_diff
from bns.diagnose.residuals.along_variables import ResidualDependence, flexible_columns, losses_with_columns
from bns.diagnose.settings import DEFAULTS

TERMS = DEFAULTS.residuals.flexible_terms
MAJORITY_CHANCE = DEFAULTS.residuals.majority_chance


def surviving(
    problem: Problem, fit: Fit, accepted: Sequence[str], left: Sequence[ResidualDependence]
) -> tuple[str, ...]:
    """Names of the accepted effects that stand beside flexible terms along what is ``left`` (significant ones, best first)."""
    terms = _different(left)
    if not terms or not accepted:
        return tuple(accepted)
    return tuple(name for name in accepted if _stands(problem, fit, name, terms))


def _different(left: Sequence[ResidualDependence]) -> list[ResidualDependence]:
    """The best term of each variable, of the first `TERMS` variables."""
    best: dict[str, ResidualDependence] = {}
    for one in left:
        best.setdefault(one.variable, one)
    return list(best.values())[:TERMS]


def _stands(problem: Problem, fit: Fit, name: str, terms: Sequence[ResidualDependence]) -> bool:
    lacking = problem.fit(fit.model.without(name), nearby=fit.jacobian_by_parameter)
    if _earns(*(_losses(problem, one, terms, centred=False) for one in (lacking, fit))):
        return True
    before, after = (_losses(problem, one, terms, centred=True) for one in (lacking, fit))
    return _earns(before, after) and _by_most(before, after)


def _losses(problem: Problem, fit: Fit, terms: Sequence[ResidualDependence], *, centred: bool) -> Array:
    """Held-out losses (trials,) of a model with flexible terms beside it."""
    columns = [flexible_columns(problem, fit, term.variable, term.channel, centred=centred) for term in terms]
    return losses_with_columns(problem, fit, np.concatenate(columns, axis=2))


def _earns(before: Array, after: Array) -> bool:
    elpd_diff, dse = paired_elpd_diff(before, after)
    return bool(elpd_diff > MIN_Z * dse)


def _by_most(before: Array, after: Array) -> bool:
    """More trials are helped than luck would help, were the effect no good in half of them."""
    helped, trials = int((after < before).sum()), len(before)
    return bool(binom.sf(helped - 1, trials, 0.5) < MAJORITY_CHANCE)
