"""Longer explanations that do the same: two effects in the place of one. With more numbers they are no tie, for the shorter is
to be preferred, but whoever mends the robot should know of them: a camera's scale that is off looks like a speed gain with a
wrong wheelbase. With no more numbers (`more_numbers`) nothing prefers the one: a Stribeck friction that hardly fades is a dead
zone and a gain, and who counts effects only has an arbitrary answer.

Which pairs might do it is read from the tracks' own sensitivities where neither effect acts; and, for what is far from linear,
from those beside an effect that does nearly all of it alone (a dead zone, of what a Stribeck friction does). They are then
fitted, and judged as competing models are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import weights
from bns.diagnose.estimate.plausibility import implausible
from bns.diagnose.parallel import each
from bns.diagnose.select.indistinguishable import indistinguishable
from bns.diagnose.select.known_effects import known_effects
from bns.diagnose.select.result import SelectionResult
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect
from bns.physics.model import ActiveEffect, Model

LEFT_OVER = DEFAULTS.select.pair_left_over
ALONE = DEFAULTS.select.pair_alone
TRIED = DEFAULTS.select.pair_tried
_SMALL = DEFAULTS.select.pair_small


def equivalent_pairs(
    problem: Problem,
    fit: Fit,
    accepted: Sequence[str],
    others: Sequence[Effect],
    nearly: Mapping[str, Sequence[ActiveEffect]] | None = None,
) -> list[tuple[str, ...]]:
    """Sets of one effect more than ``accepted`` that these tracks cannot tell from it; names in the order of the replaced one.

    ``nearly``: what may do nearly all that an accepted effect of that name does, with numbers to begin a fit from.
    """
    result: list[tuple[str, ...]] = []
    for name in accepted:
        model = fit.model.without(name)
        free = [effect for effect in others if effect.extends not in {active.effect.name for active in model.effects}]
        pairs = _promising(problem, fit, name, free)
        near = (nearly or {}).get(name, ())
        if not pairs and not near:
            continue
        without = problem.fit(model)
        begun = [(pair, _with_neutral(model, pair)) for pair in pairs]
        begun += [found for one in near for found in _completed(problem, fit, without, one, free)]
        for (pair, _), tried in zip(begun, each(problem.fit, [start for _, start in begun]), strict=True):
            names = tuple(n for one in accepted for n in ((e.name for e in pair) if one == name else (one,)))
            known = {frozenset(found) for found in result}
            if frozenset(names) in known or any(implausible(tried, effect.name) for effect in pair):
                continue
            if indistinguishable(tried, fit, without):
                result.append(names)
    return result


def more_numbers(selection: SelectionResult, names: Sequence[str]) -> int:
    """How many numbers more the effects of that set have than the accepted ones."""
    known = known_effects(selection)
    count = [sum(len(known[name].parameters) for name in some) for some in (names, selection.accepted)]
    return count[0] - count[1]


def _completed(
    problem: Problem, fit: Fit, without: Fit, near: ActiveEffect, others: Sequence[Effect]
) -> list[tuple[tuple[Effect, Effect], Model]]:
    """Pairs of an effect that does nearly all of it alone, and of what does most of the rest; and what each is fitted from."""
    alone = problem.fit(without.model.with_active(near.effect, near.values))
    gained, whole = without.loss - alone.loss, without.loss - fit.loss
    if gained < (1 - ALONE) * whole or indistinguishable(alone, fit, without):  # too little; or it is a tie by itself
        return []
    root = np.sqrt(weights(fit.whitened))[:, None]
    done = ((fit.whitened - alone.whitened) * root).ravel()
    given = (alone.jacobian * root[..., None]).reshape(len(done), -1)
    rest = [effect for effect in others if _smooth(effect) and near.effect.name not in (effect.name, effect.extends)]
    spans = _Spans(done, given, _all_columns(problem, alone.model, alone.whitened, root, rest))
    left = [(spans.left(effect.name), effect) for effect in rest]
    pairs = [(near.effect, effect) for share, effect in sorted(left, key=lambda o: o[0])[:TRIED] if share < LEFT_OVER / ALONE]
    return [(pair, _with_neutral(alone.model, pair[1:])) for pair in pairs]


def _promising(problem: Problem, fit: Fit, name: str, others: Sequence[Effect]) -> list[tuple[Effect, Effect]]:
    """Pairs whose sensitivities together span what the effect of that name does, and neither alone."""
    base = fit.model.without(name)
    whitened, root = problem.whitened(base), np.sqrt(weights(fit.whitened))[:, None]
    done = ((fit.whitened - whitened) * root).ravel()
    base_columns = (
        fit.jacobian[..., [i for i, number in enumerate(fit.free) if number.effect != name]] * root[..., None]
    )
    given = base_columns.reshape(len(done), -1)
    smooth = [effect for effect in others if _smooth(effect)]
    columns = _all_columns(problem, base, whitened, root, smooth)
    spans = _Spans(done, given, columns)
    pairs = []
    for a, b in combinations([e for e in others if e.name in columns and spans.left(e.name) > ALONE], 2):
        left = spans.left(a.name, b.name)
        if left < LEFT_OVER:
            pairs.append((left, (a, b)))
    return [pair for _, pair in sorted(pairs, key=lambda p: p[0])[:TRIED]]


def _smooth(effect: Effect) -> bool:
    """Whether the effect has derivatives where it does nothing."""
    return not any(np.isinf(value) for value in effect.neutral.values())


def _all_columns(
    problem: Problem, base: Model, whitened: Array, root: Array, effects: Sequence[Effect]
) -> dict[str, Array]:
    """Name of each effect -> sensitivities (n, k) to its k parameters."""
    added = each(lambda e: np.stack(list(_columns(problem, base, whitened, root, e)), axis=1), effects)
    return {effect.name: column for effect, column in zip(effects, added, strict=True)}


def _columns(problem: Problem, base: Model, whitened: Array, root: Array, effect: Effect) -> Iterator[Array]:
    neutral = tuple(effect.neutral.values())
    for index, p in enumerate(effect.parameters):
        small = _SMALL * (p.plausible[1] - p.plausible[0]) * (-1 if p.neutral >= p.high else 1)
        values = tuple(v + small * (i == index) for i, v in enumerate(neutral))
        yield ((problem.whitened(base.with_active(effect, values)) - whitened) / small * root).ravel()


class _Spans:
    """What mixtures of columns explain of ``done`` (n,): ``given`` (n, k) and those of some effects, (n, k) each."""

    def __init__(self, done: Array, given: Array, columns: Mapping[str, Array]) -> None:
        parts = {"": given, **columns}
        ends = np.cumsum([part.shape[1] for part in parts.values()])
        self._of = {name: np.arange(end - parts[name].shape[1], end) for name, end in zip(parts, ends, strict=True)}
        joint = np.concatenate(list(parts.values()), axis=1)
        size = np.sqrt((joint * joint).sum(axis=0))
        self._moves = size > 0
        joint /= np.where(self._moves, size, 1.0)
        self._curvature, self._gradient, self._whole = joint.T @ joint, joint.T @ done, float(done @ done)

    def left(self, *names: str) -> float:
        """Share of the squares that no mixture of the given columns and of these effects' explains."""
        used = np.concatenate([self._of[name] for name in ("", *names)])
        used = used[self._moves[used]]
        gradient = self._gradient[used]
        inverse = np.linalg.pinv(self._curvature[np.ix_(used, used)], rcond=1e-10, hermitian=True)
        return 1.0 - float(gradient @ inverse @ gradient) / max(self._whole, 1e-300)


def _with_neutral(model: Model, effects: Sequence[Effect]) -> Model:
    """The model with effects that begin where they do next to nothing."""
    for effect in effects:
        model = model.with_active(effect, tuple(effect.neutral.values()))
    return model
