"""What the families of the grammar earn on held-out trials beside a fitted model, best first, and which are significant."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import weights
from bns.diagnose.estimate.significance import MIN_Z, PairedComparison, paired_elpd_diff
from bns.diagnose.parallel import each
from bns.diagnose.residuals.along_variables import with_columns
from bns.diagnose.residuals.grammar import BY_DIRECTION, LOGGED, OF_SPEED, STEPPED, Family
from bns.diagnose.residuals.symbolic import PROBE
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect
from bns.physics.formula import WHEELS, formula_effect

CHANCE = DEFAULTS.residuals.chance
LEAST = DEFAULTS.residuals.least
LARGE, LARGE_Z = DEFAULTS.residuals.large, DEFAULTS.residuals.large_z
STEPS, FINER = DEFAULTS.residuals.rounding_steps
STEPS_A_RANGE = DEFAULTS.residuals.rounding_range
_SMALL = 1e-4


@dataclass(frozen=True)
class Earned:
    """What a family would earn on trials held out, as a linear addition to a fitted model; and its share of the loss."""

    family: Family
    paired_comparison: PairedComparison
    share: float
    losses: Array
    """Held-out losses (trials,) with it."""


def ranked(problem: Problem, fit: Fit, tried: Sequence[Family]) -> list[Earned]:
    """What each family would earn beside a fitted model, the best first."""
    usual = float(fit.losses.mean())

    def earned(family: Family) -> Earned:
        comparison, losses = with_columns(problem, fit, columns_of(problem, fit, family))
        return Earned(family, comparison, comparison.elpd_diff / usual, losses)

    return sorted(each(earned, list(tried)), key=lambda e: -e.paired_comparison.elpd_diff)


def significant(earned: Sequence[Earned]) -> list[Earned]:
    """Those that cannot be luck (the chance shared out over all that were tried), are earned in many trials, and matter."""
    level = CHANCE / max(len(earned), 1)
    return [
        e
        for e in earned
        if e.paired_comparison.p_value < level and e.share > LEAST and certain(e.paired_comparison, e.share)
    ]


def simpler_first(found: Sequence[Earned], usual: float) -> list[Earned]:
    """The same, but of two families of which one contains the other the smaller comes first, unless the larger predicts better.

    For certain, and by more than `LEAST` of ``usual``, the loss of a trial.
    """
    out = list(found)
    for larger in found:
        odd = _smaller(larger, found)
        if odd is None:
            continue
        gain, se = paired_elpd_diff(odd.losses, larger.losses)
        if not (gain > LEAST * usual and certain(PairedComparison(gain, se, 0.0), gain / usual)):
            out.remove(odd)
            out.insert(min(out.index(larger), found.index(odd)), odd)
    return out


def _smaller(larger: Earned, found: Sequence[Earned]) -> Earned | None:
    """The family that a larger one contains, with fewer numbers: an odd curve of a wheel's speed, a straight line of a column."""
    of, on = larger.family, larger.family.on
    if of.signal == BY_DIRECTION.get(on):
        return next((e for e in found if (e.family.signal, e.family.on) == (OF_SPEED[on], on)), None)
    if of.signal.startswith(LOGGED) and len(of.functions) > 1:
        return next((e for e in found if (e.family.signal, e.family.on, len(e.family.functions)) == (of.signal, on, 1)), None)
    return None


def certain(comparison: PairedComparison, share: float) -> bool:
    """Is a gain earned in many trials; or, where it is a large ``share`` of the loss, in some?"""
    return comparison.z > (LARGE_Z if share > LARGE else MIN_Z)


def rounding(problem: Problem, fit: Fit) -> Family:
    """Each wheel's speed rounded to the step that explains most, of many in `STEPS_A_RANGE` parts of the fastest."""
    fastest = float(np.abs(problem.predictor.variables()["left_m_s"]).max())
    root = np.sqrt(weights(fit.whitened))[:, None]
    left = (fit.whitened * root).ravel()

    effect = formula_effect(PROBE, "k * (a * round(u / a) - u)", WHEELS)
    assert [p.name for p in effect.parameters] == ["a", "k"]

    def pull(step: float) -> float:
        column = (_column(problem, fit, effect, (step, _SMALL)) * root).ravel()
        return float((column @ left) ** 2 / max(float(column @ column), 1e-300))

    coarse = fastest / np.linspace(*STEPS_A_RANGE, STEPS)
    best = _best(pull, coarse)
    near = np.clip([best - 1, best + 1], 0, STEPS - 1)
    fine = np.linspace(coarse[near[1]], coarse[near[0]], FINER)
    return _rounded(float(fine[_best(pull, fine)]))


def _best(score: Callable[[float], float], values: Array) -> int:
    return int(np.argmax(each(score, [float(v) for v in values])))


def _rounded(step: float) -> Family:
    return Family(STEPPED, WHEELS, (f"({step:.5g} * round(u / {step:.5g}) - u)",))


def columns_of(problem: Problem, fit: Fit, family: Family) -> Array:
    """Change of the whitened innovations for each number of a family, (frames, 3, functions)."""
    out = np.empty((*fit.whitened.shape, len(family.functions)))
    for i, function in enumerate(family.functions):
        effect = formula_effect(PROBE, f"k * {function}", family.on, problem.predictor.tracks.extra)
        out[..., i] = _column(problem, fit, effect, (_SMALL,))
    return out


def _column(problem: Problem, fit: Fit, effect: Effect, values: tuple[float, ...]) -> Array:
    """Change of the whitened innovations a unit of an effect's last number, which is `_SMALL`; (frames, 3)."""
    column: Array = (problem.whitened(fit.model.with_active(effect, values)) - fit.whitened) / _SMALL
    return column
