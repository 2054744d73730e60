"""What networks cannot know: errors that follow a variable which is none of their inputs, on trials held out.

Errors are those of whole commands. For each variable a free curve is added, as it is, in proportion to the command's duration,
and in proportion to the displacement itself: a kick, a drift and a gain that change with the variable.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.cross_validation import FOLDS
from bns.diagnose.estimate.significance import sign_flip_p
from bns.diagnose.residuals.along_variables import CHANCE, curves
from bns.diagnose.settings import DEFAULTS

LEAST = DEFAULTS.residuals.input_least
MOST = DEFAULTS.residuals.input_most
_RIDGE = DEFAULTS.residuals.input_ridge


@dataclass(frozen=True)
class MissingInput:
    """A variable, the share of the squared error (of the commands judged) that its curves explain on trials held out, and the
    chance of such a pull by luck, over all three displacements."""

    variable: str
    share: float
    p_value: float


@dataclass(frozen=True)
class Commands:
    """Errors of commands, one row each: ``trial`` (n,), ``duration_s`` (n,), ``predicted`` (n, 3) displacement and ``error``
    (n, 3) measured minus predicted, both as outputs of the networks; ``variables`` name -> (n,)."""

    trial: NDArray[np.int64]
    duration_s: Array
    predicted: Array
    error: Array
    variables: Mapping[str, Array]


def find_missing_inputs(commands: Commands) -> tuple[list[MissingInput], list[MissingInput], float]:
    """Variables that hold up, taken one after the other; all of them when tried alone, best first; and the share explained."""
    bases = dict(_bases(commands.variables))
    error, whole = commands.error, float((commands.error**2).sum())
    named: list[MissingInput] = []
    alone: list[MissingInput] = []
    gained = 0.0
    while len(named) < MOST and whole > 0:
        tried = {name: _tried(commands, error, basis) for name, basis in bases.items()}
        ranking = sorted(
            (
                MissingInput(name, (float((error**2).sum()) - float((left**2).sum())) / whole, p)
                for name, (left, p) in tried.items()
            ),
            key=lambda one: -one.share,
        )
        alone = alone or ranking
        held = [one for one in ranking if one.p_value < CHANCE / len(bases) and one.share > LEAST]
        if not held:
            break
        named.append(held[0])
        error = tried[held[0].variable][0]
        gained += held[0].share
    return named, alone, gained


def _bases(variables: Mapping[str, Array]) -> list[tuple[str, Array]]:
    """Basis functions (n, k) of every variable; a heading is taken round the circle."""
    bases = [
        (name, np.column_stack(basis))
        for name, basis in curves({k: v for k, v in variables.items() if k != "heading_rad"})
    ]
    if "heading_rad" in variables:
        bases.append(
            ("heading_rad", np.column_stack([np.cos(variables["heading_rad"]), np.sin(variables["heading_rad"])]))
        )
    return bases


def _tried(commands: Commands, error: Array, basis: Array) -> tuple[Array, float]:
    """Errors (n, 3) that curves fitted to the other trials leave, and the smallest chance of the displacements, times three."""
    left, chances = error.copy(), []
    for channel in range(error.shape[1]):
        plain = np.column_stack(
            [np.ones_like(commands.duration_s), commands.duration_s, commands.predicted[:, channel]]
        )
        added = np.concatenate([basis * factor[:, None] for factor in plain.T], axis=1)
        left[:, channel], chance = _beyond(plain, added, error[:, channel], commands.trial)
        chances.append(chance)
    return left, min(1.0, 3 * min(chances))


def _beyond(plain: Array, added: Array, error: Array, trial: NDArray[np.int64]) -> tuple[Array, float]:
    """What is left of an error when ``added`` columns (n, k) are fitted beyond ``plain`` ones, each fold by the others."""
    added = np.asarray(added / (np.sqrt((added**2).mean(axis=0)) + 1e-300), dtype=np.float64)
    left = error.copy()
    for fold in range(FOLDS):
        held = trial % FOLDS == fold
        if held.any() and not held.all():
            without = plain @ _ridge(plain[~held], error[~held], 1e-9)
            joint = np.column_stack([plain, added])
            with_added = joint @ _ridge(joint[~held], error[~held], _RIDGE, free=plain.shape[1])
            left[held] = error[held] - (with_added - without)[held]
    clean: Array = np.asarray(added - plain @ np.linalg.lstsq(plain, added, rcond=None)[0], dtype=np.float64)
    rest = error - plain @ np.linalg.lstsq(plain, error, rcond=None)[0]
    if (left**2).sum() >= (error**2).sum():  # nothing gained: how likely that was need not be asked
        return left, 1.0
    scores = np.zeros((int(trial.max()) + 1, clean.shape[1]))
    np.add.at(scores, trial, clean * rest[:, None])
    return left, sign_flip_p(scores[np.unique(trial)], clean.T @ clean)


def _ridge(columns: Array, target: Array, pull: float, free: int = 0) -> Array:
    """Coefficients of a ridge regression; the first ``free`` columns are hardly pulled."""
    penalty = np.full(columns.shape[1], pull)
    penalty[:free] = 1e-9 * len(columns)
    return np.asarray(np.linalg.solve(columns.T @ columns + np.diag(penalty), columns.T @ target), dtype=np.float64)
