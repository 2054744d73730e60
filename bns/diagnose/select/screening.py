"""Which effects are worth a fit where a fit is costly: a score test of each, on few of the tracks and then on more.

Nothing is fitted: the slope of the residuals along an effect's numbers, where it does nothing, says how hard the tracks pull on
it, and how rarely luck pulls so hard (Rao's score test, with the sign flips of `significance` for its distribution).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.problem import problem_with_noise
from bns.diagnose.estimate.pseudo_inverse import pseudo_inverse
from bns.diagnose.estimate.significance import chance
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect
from bns.physics.jointed.pieced import PiecedEffect

MOST = DEFAULTS.select.screen_most
CHANCE = DEFAULTS.select.screen_chance
CHANCE_OF_ALL = DEFAULTS.select.screen_chance_of_all
_FIRST = DEFAULTS.select.screen_first
_BEHIND = DEFAULTS.select.screen_behind
_SHARE = DEFAULTS.select.screen_share


@dataclass(frozen=True)
class Screened:
    """An effect, by how much its numbers could lower the loss to first order, and the chance of such a pull by luck.

    ``values``: at which this was found, of those that are tried.
    """

    effect: Effect
    gain: float
    p_value: float
    values: tuple[float, ...] = ()


def screened(problem: Problem, fit: Fit, effects: Sequence[Effect]) -> list[Screened]:
    """Effects on the tracks of a predictor, the one that could lower the loss most first.

    A predictor that has fewer tracks to screen on tries all effects on those, and on all of its own only the better ones, each
    at the values that did best.
    """
    ways = {effect.name: tuple(_ways(effect)) for effect in effects}
    light = problem.predictor.screening
    if light is not None:
        light.anchor(fit.model)
        few = problem_with_noise(light, light.steps(fit.model), problem.pose_filter.noise)
        found = screened(few, few.fit(fit.model, rounds=0), effects)
        kept = _first(found) if light.screening is None else _likely(found, CHANCE)
        effects, ways = [s.effect for s in kept], {s.effect.name: (s.values,) for s in kept}
    return sorted((_scored(problem, fit, effect, ways[effect.name]) for effect in effects), key=lambda s: -s.gain)


def worth_a_fit(found: Sequence[Screened]) -> list[Effect]:
    """Of those screened on all tracks, the first `MOST` that luck does not explain at once, unless far behind the best.

    The best one in any case: what comes nearest is shown, too.
    """
    return [s.effect for s in _likely(found, CHANCE_OF_ALL) or found[:1]]


def _first(found: Sequence[Screened]) -> Sequence[Screened]:
    """What goes on from the fewest tracks, whose p-values say little."""
    return _near_the_best(found)[: max(MOST, math.ceil(_FIRST * len(found)))]


def _likely(found: Sequence[Screened], chance: float) -> Sequence[Screened]:
    return _near_the_best([s for s in found if s.p_value < chance])[:MOST]


def _near_the_best(found: Sequence[Screened]) -> Sequence[Screened]:
    best = max((s.gain for s in found), default=0.0)
    return [s for s in found if s.gain >= _BEHIND * best]


def _scored(few: Problem, base: Fit, effect: Effect, ways: Sequence[tuple[float, ...]]) -> Screened:
    return max((_scored_at(few, base, effect, values) for values in ways), key=lambda s: s.gain)


def _ways(effect: Effect) -> Iterator[tuple[float, ...]]:
    """Values of the numbers, each to be tried alone: well inside of what is plausible, to the side where that reaches further.

    Of a multiple to both sides: a servo of half the stiffness does not do the opposite of what one of twice the stiffness does.
    And where robots reach a bound, there: a joint without torque moves in another way than a weak one.
    """
    if isinstance(effect, PiecedEffect):  # none of its numbers does anything alone
        yield from effect.starts
        return
    numbers = effect.parameters
    both = any(p.is_multiple and p.plausible[0] < 1 < p.plausible[1] for p in numbers)
    if both:
        for upwards in (False, True):
            yield tuple(p.part_way(_SHARE, upwards) for p in numbers)
    else:
        yield tuple(p.part_way(_SHARE, p.plausible[1] - p.neutral >= p.neutral - p.plausible[0]) for p in numbers)
    if len(numbers) == 1:
        for bound in numbers[0].reached:
            yield (bound,)
        if numbers[0].neutral == 0.0:
            yield from _nearest(effect)


def _nearest(effect: Effect) -> Iterator[tuple[float, ...]]:
    """Of the starts of a number that is added, the nearest to nothing on each side.

    A delay that is long for fast commands leaves nothing of them to compare: the slope towards it says nothing of a short one.
    """
    for side in (-1, 1):
        away = [side * value for (value,) in effect.starts if side * value > 0]
        if away:
            yield (side * min(away),)


def _scored_at(few: Problem, base: Fit, effect: Effect, values: tuple[float, ...]) -> Screened:
    if isinstance(effect, PiecedEffect):
        columns = (few.whitened(base.model.with_active(effect, values)) - base.whitened)[..., None]
    else:
        columns = np.stack([_column(few, base, effect, index, value) for index, value in enumerate(values)], axis=2)
    columns = columns[..., np.abs(columns).max(axis=(0, 1)) > 0]
    if not columns.shape[2]:
        return Screened(effect, 0.0, 1.0, values)
    equations = few.normal_equations(np.concatenate([base.jacobian, columns], axis=2), base.whitened)
    gradient, curvature = equations.gradients.sum(axis=0), equations.curvatures.sum(axis=0)
    given = base.jacobian.shape[2]  # numbers of the base gain on few tracks, too, where they were fitted to others
    gain = _gain(gradient, curvature) - _gain(gradient[:given], curvature[:given, :given])
    return Screened(effect, gain, chance(equations, given), values)


def _gain(gradient: Array, curvature: Array) -> float:
    """By how much a step of least squares lowers the loss."""
    return float(gradient @ pseudo_inverse(curvature) @ gradient) / 2


def _column(few: Problem, base: Fit, effect: Effect, index: int, value: float) -> Array:
    """What a unit of one number changes in the whitened innovations, from neutral to that value."""
    p = effect.parameters[index]
    values = tuple(value if q is p else q.neutral for q in effect.parameters)
    moved: Array = (few.whitened(base.model.with_active(effect, values)) - base.whitened) / (value - p.neutral)
    return moved
