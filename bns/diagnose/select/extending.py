"""Effects that contain a simpler one (`Effect.extends`): each comes in the place of that one, and goes back to it.

One that has no parameters beside those of the simpler one does the same elsewhere in the chain: the better fit of both counts.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.lacking import fit_without
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect

_EVIDENCE = DEFAULTS.select.variant_evidence
_SAME = DEFAULTS.select.variant_same
Exchange = tuple[str, str, Fit]
"""An accepted name, the name of what takes its place, and the fit."""


def extended(catalogue: Mapping[str, Effect], name: str) -> tuple[str, ...]:
    """The name of the effect that this one extends, if it does and that one may be missing (it is in the catalogue)."""
    extends = catalogue[name].extends if name in catalogue else ""
    return (extends,) if extends in catalogue else ()


def variant(catalogue: Mapping[str, Effect], name: str) -> bool:
    """Whether an effect has the parameters of the one that it extends and no others: it acts at another place in the chain."""
    parts = extended(catalogue, name)
    return bool(parts) and {p.name for p in catalogue[name].parameters} == {p.name for p in catalogue[parts[0]].parameters}


@dataclass(frozen=True)
class Moved:
    """A fit with an effect at another place in the chain (`variant`), where it does the same: nothing acts between the places."""

    fit: Fit
    places: tuple[float, float]

    def parted_by(self, effect: Effect) -> bool:
        """Does that effect act between the two places, so that beside it they differ?"""
        return min(self.places) < effect.place < max(self.places)


def moved_in_chain(
    catalogue: Mapping[str, Effect], problem: Problem, fit: Fit, accepted: Collection[str]
) -> list[Moved]:
    """Each accepted effect at its other place in the chain, where that makes no difference in this model.

    A limit of the motors' force may be one of the tyres' grip as long as no lag is between them. Such a lag may show beside the
    second alone: a ramp that is limited before the lag and ends late is no ramp that begins late.
    """
    found = []
    for name in accepted:
        for other in (effect for effect in catalogue.values() if variant(catalogue, effect.name) and name in effect.parts):
            values = other.neutral | fit.model.values_of(name)
            model = fit.model.without(name).with_active(other, tuple(values[p.name] for p in other.parameters))
            if abs(problem.loss(model) - fit.loss) < _SAME:
                found.append(Moved(problem.fit(model), (catalogue[name].place, other.place)))
    return found


def fits_better(before: Fit, after: Fit) -> bool:
    """Do trials held out speak for the second of two models with as many parameters, at odds of 20 to 1 (`variant_evidence`)?"""
    return bool(before.held_out.sum() - after.held_out.sum() > _EVIDENCE)


def simple(catalogue: Mapping[str, Effect], effects: Iterable[Effect], accepted: Collection[str]) -> list[Effect]:
    """The effects that extend no other and are neither accepted nor a part of what is."""
    there = {*accepted, *(part for name in accepted for part in extended(catalogue, name))}
    return [effect for effect in effects if not effect.extends and effect.name not in there]


def to_extend(
    effects: Iterable[Effect], fit: Fit, accepted: Collection[str], exchanges: Callable[[], Iterable[Exchange]]
) -> dict[str, tuple[str, Fit]]:
    """Name of an effect that extends another -> which effect it would replace, and the fit that it begins from.

    It extends an effect of the model, given or accepted, or one that could stand for an accepted effect nearly as well, among
    ``exchanges``; or an accepted effect extends the same one in another way.
    """
    lone = {effect.name for effect in lone_of(effects, fit, accepted)}
    others = list(exchanges()) if lone else []
    found: dict[str, tuple[str, Fit]] = {}
    for effect in (effect for effect in effects if effect.extends and effect.name not in accepted):
        if effect.name in lone:
            found |= beside([effect], others)
        else:
            found[effect.name] = _replaced(effect, effects, fit, accepted), fit
    return found


def lone_of(effects: Iterable[Effect], fit: Fit, accepted: Collection[str]) -> list[Effect]:
    """Effects that extend one which is not in the model, and which nothing accepted extends in another way."""
    effects = list(effects)
    return [e for e in effects if e.extends and e.name not in accepted and not _replaced(e, effects, fit, accepted)]


def beside(lone: Iterable[Effect], exchanges: Collection[Exchange]) -> dict[str, tuple[str, Fit]]:
    """Name of an effect that extends another -> the accepted effect in whose place that other fits best, and that fit."""
    found: dict[str, tuple[str, Fit]] = {}
    for effect in lone:
        near = [(tried.loss, name, tried) for name, other, tried in exchanges if other == effect.extends]
        if near:
            _, name, tried = min(near, key=lambda n: n[0])
            found[effect.name] = name, tried
    return found


def _replaced(effect: Effect, effects: Iterable[Effect], fit: Fit, accepted: Collection[str]) -> str:
    """What an effect that extends another would replace in the model: a part of it, or what extends that part, too; else ""."""
    there = {active.effect.name for active in fit.model.effects}
    part = next((name for name in effect.parts if name in there), "")
    return part or next((e.name for e in effects if e.extends == effect.extends and e.name in accepted), "")


def shorter(catalogue: Mapping[str, Effect], problem: Problem, fit: Fit, name: str) -> tuple[str, Fit] | None:
    """The name of an effect that one of the fit contains, and the fit with it in the place of that one; None if there is none."""
    parts = [part for part in (catalogue[name].contains if name in catalogue else ()) if part in catalogue]
    if not parts:
        return None
    part, values = catalogue[parts[0]], fit.model.values_of(name)
    model = fit.model.without(name).with_active(part, tuple(values[p.name] for p in part.parameters))
    return part.name, problem.fit(model, nearby=fit.jacobian_by_parameter)


def reduced(catalogue: Mapping[str, Effect], problem: Problem, fit: Fit, name: str) -> Fit:
    """The fit that lacks an effect; of one that extends another, with that other in its place."""
    parts = extended(catalogue, name)
    if not parts:
        return fit_without(problem, fit, name)
    model, values = fit.model.without(name), fit.model.values_of(name)
    for part in parts:
        model = model.with_active(catalogue[part], tuple(values[p.name] for p in catalogue[part].parameters))
    return problem.fit(model, nearby=fit.jacobian_by_parameter)
