"""What the unlisted might be: a short formula in the known variables, or the place it is tied to.

The free curves of `along_variables` say along which variable and in which velocity the model fails. Here orthogonal matching
pursuit (scikit-learn) picks the few terms of a library that explain it; what it picks is then fitted as an effect
like any other, and offered with its held-out gain as a term that `bns add` takes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import count, product

import numpy as np

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import weights
from bns.diagnose.estimate.significance import PairedComparison
from bns.diagnose.parallel import each
from bns.diagnose.residuals.along_variables import SHARE, ResidualDependence
from bns.diagnose.settings import DEFAULTS
from bns.errors import ModelError
from bns.physics.effect import Effect
from bns.physics.formula import SHARE as SHARED
from bns.physics.formula import formula_effect
from bns.physics.model import Model

NAME = "unlisted"
PROBE = "probe"
"""Name of an addition that is only tried: a model may hold a term called `NAME`, which must stay in it."""
_ON = {"forward_m_s": "v", SHARE: "v", "sideways_m_s": "s", "yaw_rad_s": "w", "east_m_s": "east", "north_m_s": "north"}
_CARRIERS = {
    "v": ("v", "moving"),
    "s": ("v", "v*w", "moving"),
    "w": ("w", "v", "moving"),
    "east": ("moving",),
    "north": ("moving",),
}
"""What a curve may multiply, by the velocity it adds to."""
_SHAPES = {
    "left_m_s": ("l", "abs(l)", "l**2", "sign(l)"),
    "right_m_s": ("r", "abs(r)", "r**2", "sign(r)"),
    "speed_m_s": ("v", "abs(v)", "v**2", "sign(v)"),
    "wheel_difference_m_s": ("w", "abs(w)", "w**2", "max(w, 0)", "min(w, 0)", "sign(w)"),
    "time_in_trial_s": ("tau", "exp(-tau)", "exp(-tau/3)", "exp(-tau/8)", "tau**2"),
    "session_s": ("t", "t**2"),
    "heading_rad": ("sin(heading)", "cos(heading)", "sin(2*heading)", "cos(2*heading)"),
    "turned_rad": ("turned", "turned * abs(turned)"),
    "way_m": ("d", "exp(-d)", "d**2"),
    "place": ("x", "y", "x*y", "x**2", "y**2"),
}
PATCH_SIDE = DEFAULTS.residuals.patch_side
PATCH_RADII = DEFAULTS.residuals.patch_radii
OWN_LEFT = DEFAULTS.residuals.formula_own_left
_TERMS_AT_MOST = DEFAULTS.residuals.formula_terms


@dataclass(frozen=True)
class Formula:
    """A candidate: ``term`` to add to the velocity ``on``, its fit, and what it earns on held-out trials."""

    on: str
    term: str
    fit: Fit
    paired_comparison: PairedComparison
    name: str = NAME
    signal: str = ""
    """What it is a function of, in words."""
    below_noise: bool = False
    """Is the error without it higher by less than tracking noise (`bns.diagnose.select.negligible.below_noise`)?"""

    @property
    def values(self) -> dict[str, float]:
        """The fitted numbers of the formula."""
        return self.fit.model.values_of(self.name)

    @property
    def certain(self) -> bool:
        """Does the interval of any of its factors (k, k0, ...) leave out 0? Else the term may be nothing.

        What it earns on held-out trials is no answer: that is worked out to first order, and where the filter starts again
        after poses that are far off, the loss has steps, beside which a tiny number earns much.
        """
        own = [j for j, free in enumerate(self.fit.free) if free.effect == self.name and free.parameter.name.startswith("k")]
        return any(low > 0.0 or high < 0.0 for low, high in map(self.fit.interval, own))


def free_name(model: Model) -> str:
    """The first of unlisted, unlisted-2, ... that no term of the model has; a model that was extended before has one already."""
    taken = {active.effect.name for active in model.effects}
    return next(name for n in count(1) if (name := NAME if n == 1 else f"{NAME}-{n}") not in taken)


def best_formula(problem: Problem, fit: Fit, dependence: Sequence[ResidualDependence]) -> Formula | None:
    """The formula that earns most along the patterns that were found; None if none earns anything for certain."""
    tried = each(partial(_tried, problem, fit), dependence[:3])
    return max(
        (f for of_one in tried for f in of_one if f.paired_comparison.elpd_diff > 0 and f.certain),
        key=lambda f: f.paired_comparison.elpd_diff,
        default=None,
    )


def _tried(problem: Problem, fit: Fit, pattern: ResidualDependence) -> list[Formula]:
    on = _ON[pattern.channel]
    terms = [f"{c} * {shape}" for c in _CARRIERS[on] for shape in _SHAPES.get(pattern.variable, ())]
    tried = [_sparse(problem, fit, on, [*_CARRIERS[on], *terms])] if terms else []
    if pattern.variable == "place":
        tried.append(patch(problem, fit, SHARED if pattern.channel == SHARE else on, free_name(fit.model)))
    return [f for f in tried if f is not None]


def _sparse(problem: Problem, fit: Fit, on: str, terms: Sequence[str]) -> Formula | None:
    """The one to three terms that orthogonal matching pursuit takes; as many as still earn something held out."""
    from sklearn.linear_model import orthogonal_mp  # noqa: PLC0415  # slow to load

    usable, columns, whole, root = [], [], [], np.sqrt(weights(fit.whitened))[:, None]
    for term in terms:
        effect = formula_effect(PROBE, f"k * {term}", on)
        try:
            columns.append(_column(problem, fit, effect))
            whole.append(float(np.linalg.norm(columns[-1] * root)))
        except ModelError:
            continue  # a pole on these trials
        usable.append(term)
    matrix = np.stack([_weighted(fit, c) for c in columns], axis=1)
    size = np.linalg.norm(matrix, axis=0)
    keep = size > np.maximum(1e-9 * size.max(), OWN_LEFT * np.array(whole))  # else a number of the model's does the same
    matrix, usable = matrix[:, keep] / size[keep], [t for t, k in zip(usable, keep, strict=True) if k]
    target, best = -_weighted(fit, fit.whitened), None
    for most in range(1, min(_TERMS_AT_MOST, len(usable)) + 1):
        chosen = [usable[i] for i in np.flatnonzero(orthogonal_mp(matrix, target, n_nonzero_coefs=most))]
        term = " + ".join(f"k{i} * {t}" for i, t in enumerate(chosen))
        formula = fitted(problem, fit, on, term, free_name(fit.model))
        if formula is None or (
            best is not None and formula.paired_comparison.elpd_diff < 1.1 * best.paired_comparison.elpd_diff
        ):
            break
        best = formula
    return best


def patch(problem: Problem, fit: Fit, on: str, name: str = NAME) -> Formula | None:
    """A round patch of floor with a soft rim: where, how wide, how strong; None if it runs away from where the robot was."""
    pose = problem.predictor.tracks.pose
    (x0, x1), (y0, y1) = np.quantile(pose[:, 0], [0.05, 0.95]), np.quantile(pose[:, 1], [0.05, 0.95])
    carrier = f"{_CARRIERS[on][0]} * " if on in _CARRIERS else ""
    best, left = None, _weighted(fit, fit.whitened)
    for cx, cy in product(np.linspace(x0, x1, PATCH_SIDE), np.linspace(y0, y1, PATCH_SIDE)):
        for width in np.array(PATCH_RADII) * np.hypot(x1 - x0, y1 - y0):
            shape = _disc(f"(x - {cx:.3g})", f"(y - {cy:.3g})", f"{width:.3g}").replace("- -", "+ ")
            column = _weighted(fit, _column(problem, fit, formula_effect(PROBE, f"k * {carrier}{shape}", on)))
            pull, size = float(column @ left), max(float(column @ column), 1e-300)
            if best is None or pull**2 / size > best[0]:
                best = (pull**2 / size, -pull / size, cx, cy, width)
    assert best is not None
    term = f"k * {carrier}{_disc('(x - a)', '(y - b)', 'c')}"
    effect = formula_effect(name, term, on, of_any_size=False)
    start = dict(zip("kabc", best[1:], strict=True))
    model = fit.model.with_active(effect, _within(effect, start))
    try:
        added = problem.fit(_written(model, term, on, name))
    except ModelError:
        return None
    formula = Formula(on, term, added, problem.paired_comparison(fit, added), name, "place")
    inside = x0 <= formula.values["a"] <= x1 and y0 <= formula.values["b"] <= y1
    return formula if inside else None


def _within(effect: Effect, start: Mapping[str, float]) -> tuple[float, ...]:
    """Start values that the parameters may have; 0 where none is given. A step of least squares can lead far beyond."""
    return tuple(float(np.clip(start.get(p.name, 0.0), p.low, p.high)) for p in effect.parameters)


def _disc(x: str, y: str, radius: str) -> str:
    """1 inside, 0 outside, from 0.9 to 0.1 within a seventh of the radius either way."""
    return f"(1 / (1 + (({x}**2 + {y}**2) / {radius}**2)**8))"


def fitted(
    problem: Problem,
    fit: Fit,
    on: str,
    term: str,
    name: str = NAME,
    signal: str = "",
    start: Mapping[str, float] | None = None,
) -> Formula | None:
    """The model with a term whose numbers begin at ``start`` (0), all numbers fitted; None where it cannot be calculated."""
    effect = formula_effect(name, term, on, problem.predictor.tracks.extra, of_any_size=False)
    start = start or {}
    model = _written(fit.model.with_active(effect, _within(effect, start)), term, on, name)
    try:
        added = problem.fit(model)
    except ModelError:
        return None
    return Formula(on, term, added, problem.paired_comparison(fit, added), name, signal)


def _written(model: Model, term: str, on: str, name: str = NAME) -> Model:
    effects = tuple(replace(a, written={"term": term, "on": on}) if a.effect.name == name else a for a in model.effects)
    return replace(model, effects=effects)


def _column(problem: Problem, fit: Fit, effect: Effect) -> np.ndarray:
    small = 1e-4
    changed: np.ndarray = (problem.whitened(fit.model.with_active(effect, (small,))) - fit.whitened) / small
    return changed


def _weighted(fit: Fit, columns: np.ndarray) -> np.ndarray:
    """One long row, without what the model's own numbers could do as well."""
    root = np.sqrt(weights(fit.whitened))[:, None]
    flat = (columns * root).ravel()
    if not fit.jacobian.shape[2]:
        return flat
    own = (fit.jacobian * root[..., None]).reshape(len(flat), -1)
    return flat - own @ np.linalg.lstsq(own, flat, rcond=None)[0]
