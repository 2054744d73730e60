"""What may be missing: every listed effect and every decoy, each fitted from the most promising of several starts."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import prod

import numpy as np

from bns.diagnose.data.tracks import Tracks
from bns.diagnose.estimate.fit import Fit, StartingPoint
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.look_around import lower_place
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.settings import DEFAULTS
from bns.errors import EffectError, ModelError
from bns.physics.effect import Effect, Parameter
from bns.physics.model import Model
from bns.physics.order import FORMULAS, FRICTION, RAMPS

_SHARES = DEFAULTS.estimate.start_shares
NOTHING = DEFAULTS.estimate.start_nothing
_LIMITS = DEFAULTS.estimate.start_limits
_MOST = DEFAULTS.estimate.start_most
_LOOKS = DEFAULTS.estimate.look_rounds
_BETWEEN = DEFAULTS.estimate.start_between


def listed(
    model: Model,
    extra: Mapping[str, Effect] | None = None,
    tracks: Tracks | None = None,
    without: Collection[str] = (),
) -> dict[str, Effect]:
    """Name -> effect that the model does not have yet, from the catalogue and from ``extra``; ranges fit the robot's size.

    Of the catalogue only what ``tracks`` can speak of, and nothing that is named in ``without``.
    """
    barred = {active.effect.name for active in model.effects} | set(without)
    unfit = ("track" if tracks.relative else "motions") if tracks is not None else None
    stopped = tracks is not None and not tracks.timed
    catalogue = {
        name: fitting(e, model, tracks)
        for name, e in model.catalogue().items()
        if e.needs != unfit and not (stopped and e.stage == "clock")
    }
    return {name: effect for name, effect in {**catalogue, **(extra or {})}.items() if name not in barred}


def fitting(effect: Effect, model: Model, tracks: Tracks | None) -> Effect:
    """The effect with ranges and starts for the model's size, the floor on which the robot was seen, and the longest trial."""
    scaled = effect.scaled(model.wheelbase_m)
    if tracks is None or not len(tracks.pose):
        return scaled
    low, high = np.quantile(tracks.pose[:, :2], [0.02, 0.98], axis=0)
    within = scaled.within(low, high)
    return within if tracks.relative else within.lasting(float(tracks.own_s.max()))


def fit_with(problem: Problem, base: Fit, effect: Effect, known: Model | None = None) -> Fit:
    """The model with that effect, all numbers fitted; from the best of the effect's starts.

    ``known``: a model whose numbers of the effect, where it has it, are one start more: places have many valleys.
    An effect that earns next to nothing there, and promises nothing, is not followed further: the answer would be the same.
    Where the numbers of ``base`` do by now what the effect does, every start is worse, and all of them have to move at once. Of a
    body, which is simulated for minutes, promises are not followed.
    """
    start = best_start(problem, base, effect, known)
    hoped = min(start.loss, start.promised) if problem.predictor.screening is None else start.loss
    hopeless = base.loss - hoped < NOTHING * base.loss / len(base.losses)
    fit = problem.fit(start.model, 0 if hopeless else None, start.jacobian_by_parameter)
    if effect.after == FORMULAS and len(effect.starts) > 1 and not hopeless:
        fit = _further(problem, fit)
    return on_either_side(problem, fit, effect)


def _further(problem: Problem, fit: Fit) -> Fit:
    """The fit again from where it ended while that is lower: a number that began a hundred times too small has a long way."""
    for _ in range(_LOOKS):
        again = problem.fit(fit.model)
        if again.loss >= fit.loss:
            break
        fit = again
    return fit


def on_either_side(problem: Problem, fit: Fit, effect: Effect) -> Fit:
    """The fit, or that with friction on the other side of the ramps where this is better: asked when one of the two came in."""
    moved = fit.model.with_friction_moved() if effect.name in {*FRICTION, *RAMPS} else None
    if moved is None:
        return fit
    other = problem.fit(moved)
    return other if other.loss < fit.loss else fit


def fit_extended(problem: Problem, base: Fit, effect: Effect, given: bool = False) -> Fit:
    """The fit with an effect in the place of the one of ``base`` that it ``extends``, from that one's numbers.

    Or in the place of one that extends the same effect in another way. ``given``: that one comes back if this goes. Of an effect
    with a jagged loss its own starts are tried, too: its best place may be far from that of the simpler one.
    """
    alike = {*effect.parts, *(a.effect.name for a in base.model.effects if a.effect.extends == effect.extends)}
    gone = next(a.effect.name for a in base.model.effects if a.effect.name in alike)
    names = {p.name for p in effect.parameters}
    known = {name: value for name, value in base.model.values_of(gone).items() if name in names}
    own = [p for p in effect.parameters if p.name not in known]
    varied = {p.name for p in own if not p.is_multiple} or {p.name for p in own}  # a multiple of nothing does nothing
    neutral = {name: [value] for name, value in {**effect.neutral, **known}.items()}
    starts = product(*(neutral[p.name] + (list(_grid(p)) if p.name in varied else []) for p in effect.parameters))
    jagged = any(p.jagged for p in own)
    bare = base.model if given else base.model.without(gone)
    more = _starts(effect, problem.predictor, bare) if jagged else ()
    models = [bare.with_active(effect, values) for values in (*starts, *more)]
    fit = on_either_side(problem, problem.fit(min(models, key=problem.loss)), effect)
    return _from_lower_places(problem, fit) if jagged else fit


def _from_lower_places(problem: Problem, fit: Fit) -> Fit:
    """The fit again from each lower place that is seen from its end, while it ends lower there."""
    for _ in range(_LOOKS):
        there = lower_place(problem.loss, fit.model, fit.free, fit.loss)
        again = fit if there is None else problem.fit(there)
        if again.loss >= fit.loss:
            break
        fit = again
    return fit


def best_start(problem: Problem, base: Fit, effect: Effect, known: Model | None = None) -> StartingPoint:
    """The fitted model with the effect at the most promising of its starts, one step of least squares taken.

    An effect with a jagged loss, beside one that looks like it, is judged after that step: what the other one makes up for now,
    such as a lag for the ticks of a clock, has to give way first. Where a formula does nothing at some starts (a limit that
    nothing reaches), more are tried on the way to them: no slope leads away from there.
    """
    starts = [base.model.with_active(effect, values) for values in _starts(effect, problem.predictor, base.model)]
    if known is not None and effect.name in {active.effect.name for active in known.effects}:
        starts.append(base.model.with_active(effect, tuple(known.values_of(effect.name).values())))
    losses = _losses(problem, starts)
    if effect.after == FORMULAS and len(effect.parameters) == 1:
        tried = [next(iter(start.values_of(effect.name).values())) for start in starts]
        between = _beside_idle(tried, losses, base.loss)
        more = [base.model.with_active(effect, (value,)) for value in between]
        starts, losses = [*starts, *more], [*losses, *_losses(problem, more)]
    beside = {active.effect.name for active in base.model.effects} & set(effect.lookalikes)
    all_of_them = beside and any(p.jagged for p in effect.parameters)
    all_of_them = all_of_them or (effect.after == FORMULAS and len(effect.parameters) > 1)  # nothing yet, whatever the others are
    followed = range(len(starts)) if all_of_them else [int(np.argmin(losses))]
    return min((_stepped(problem, base, starts[i], losses[i]) for i in followed), key=lambda one: one.loss)


def _losses(problem: Problem, starts: Sequence[Model]) -> list[float]:
    """Infinite where a formula has no value; ModelError if it has none anywhere."""
    out, wrong = [], None
    for start in starts:
        try:
            out.append(problem.loss(start))
        except EffectError:
            raise
        except ModelError as error:
            out.append(np.inf)
            wrong = error
    if wrong is not None and not np.isfinite(out).any():
        raise wrong
    return out


def _beside_idle(values: list[float], losses: list[float], idle: float) -> list[float]:
    """Values between the best of those at which something changes and the nearest of its sign at which nothing does, by ratio."""
    same = np.isclose(losses, idle, rtol=1e-9, atol=0.0)
    if same.all() or not same.any():
        return []
    best = values[int(np.argmin(np.where(same, np.inf, losses)))]
    still = [value for value, nothing in zip(values, same, strict=True) if nothing and value * best > 0.0]
    nearest = min(still, key=lambda value: abs(np.log(value / best)), default=best)
    return [] if nearest == best else [float(v) for v in np.geomspace(best, nearest, _BETWEEN + 2)[1:-1]]


def _stepped(problem: Problem, base: Fit, start: Model, loss: float) -> StartingPoint:
    """One step of least squares from a start, or the start itself where that is lower or no step leads anywhere."""
    try:
        stepped = problem.gauss_newton_step(start, base)
    except ModelError:  # a formula has no value there
        return StartingPoint(start, loss, loss, {})
    return stepped if stepped.loss < loss else replace(stepped, model=start, loss=loss)


def _starts(effect: Effect, predictor: Predictor, model: Model) -> Iterator[tuple[float, ...]]:
    """Within the bounds of the numbers, whatever the effect makes of the poses; its neutral values where nothing is left."""
    lows, highs = ([getattr(p, end) for p in effect.parameters] for end in ("low", "high"))
    found = [values for values in _proposed(effect, predictor, model) if not np.isnan(values).any()]
    for values in found or [tuple(effect.neutral.values())]:
        yield tuple(np.clip(values, lows, highs).tolist())


def _proposed(effect: Effect, predictor: Predictor, model: Model) -> Iterator[tuple[float, ...]]:
    if effect.starts_from is not None and isinstance(predictor, WheelPredictor):
        yield from predictor.starts_of(effect, model)
        return
    if effect.starts:
        yield from effect.starts
        return
    grids = [list(_grid(p)) for p in effect.parameters]
    if len(grids) == 2 or prod(map(len, grids)) > _MOST:  # along each axis: the effect of all is nearly the sum of each
        neutral = tuple(effect.neutral.values())
        limits = [axis for axis, value in enumerate(neutral) if np.isinf(value)]
        for axis in limits or range(len(grids)):  # beside a limit that is infinite no other number does anything
            for value in grids[axis]:
                yield tuple(value if i == axis else n for i, n in enumerate(neutral))
    else:
        yield from product(*grids)


def _grid(p: Parameter) -> Iterator[float]:
    low, high = p.plausible
    if np.isinf(p.neutral):
        yield from (float(v) for v in np.geomspace(low, high, _LIMITS))
        return
    for end in (low, high):
        yield from (p.neutral + share * (end - p.neutral) for share in _SHARES if end != p.neutral)
