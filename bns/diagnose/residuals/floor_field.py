"""Does an effect of a body only imitate a floor that is not alike everywhere?

The counterpart of `established` for bodies, whose effects act through joints and contacts: no curve added to a velocity can do
what they do. But a link that grips does nearly what a rough place does, if the link is mostly there. So where something is left,
a free field of friction over the floor is added beside each accepted effect: tents, each simulated once.
"""

from __future__ import annotations

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.significance import paired_elpd_diff
from bns.diagnose.predict.jointed import JointedPredictor
from bns.diagnose.residuals.along_variables import CHANCE, with_columns
from bns.diagnose.residuals.ranked_families import certain
from bns.diagnose.settings import DEFAULTS
from bns.physics.jointed.pieced import Piece, PiecedEffect

PATCH = "floor-patch"
KEPT = DEFAULTS.residuals.kept_share
_WIDE_M = 10.0
"""Within it of the origin there are all tents."""


def imitating_floor(problem: Problem, fit: Fit, accepted: tuple[str, ...]) -> tuple[str, ...]:
    """Accepted effects to which a field of friction leaves less than `kept_share` of what they gain without it, the least first.

    Each is judged beside those that are kept. The field must be certain where the effect is not in the model. A patch of floor
    is no imitation of one, nor is an effect of the camera.
    """
    pieces = _tents(problem)
    lost: tuple[str, ...] = ()
    left = [a.effect.name for a in fit.model.effects if a.effect.stage == "mechanics" and a.effect.name in accepted]
    while pieces and (names := [name for name in left if name != PATCH and name not in lost]):
        shares = {name: _kept(problem, fit, name, pieces) for name in names}
        least = min(shares, key=lambda name: shares[name])
        if shares[least] >= KEPT:
            break
        lost, fit = (*lost, least), problem.fit(fit.model.without(least))
    return lost


def _kept(problem: Problem, fit: Fit, name: str, pieces: list[Piece]) -> float:
    """The share of an effect's gain on held-out trials that is left next to the field; 1 where the field is not certain."""
    lacking = problem.fit(fit.model.without(name), nearby=fit.jacobian_by_parameter)
    alone = paired_elpd_diff(lacking.held_out, fit.held_out)[0]
    comparison, without = with_columns(problem, lacking, _field(problem, lacking, pieces))
    share = comparison.elpd_diff / float(lacking.losses.mean())
    if alone <= 0 or comparison.p_value > CHANCE or not certain(comparison, share):
        return 1.0
    beside = with_columns(problem, fit, _field(problem, fit, pieces))[1]
    return paired_elpd_diff(without, beside)[0] / alone


def _tents(problem: Problem) -> list[Piece]:
    """All tents of the floor, of a body that lies on one."""
    if not isinstance(problem.predictor, JointedPredictor):
        return []
    patch = problem.predictor.listed(PATCH)
    if not isinstance(patch, PiecedEffect):
        return []
    return [piece for piece, _ in patch.pieces(0.0, 0.0, _WIDE_M, 2.0)]


def _field(problem: Problem, fit: Fit, pieces: list[Piece]) -> Array:
    """Change of the whitened innovations by each tent, (frames, 3 + k, tents), without what a level floor does.

    A field whose mean is not 0 could stand for a friction that is another one everywhere.
    """
    rise = pieces[0].parameters[0].plausible[1]
    columns = [problem.whitened(fit.model.with_active(piece, (rise,))) - fit.whitened for piece in pieces]
    tents = np.stack([column for column in columns if np.abs(column).max() > 0], axis=-1)
    return np.asarray(tents - tents.mean(axis=-1, keepdims=True))
