"""Explanations that an experiment should tell apart, each fitted to the same tracks under the same noise."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.fit import Fit, Problem
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.residuals.symbolic import NAME as FORMULA
from bns.diagnose.select.stepwise import Found, problem_for
from bns.physics.effect import Effect
from bns.physics.effects import all_effects
from bns.physics.model import Model

MOST, MOST_TIED = 3, 5
"""Explanations held against each other at most, after a clear verdict and after a tie: pairs grow with the square."""


@dataclass(frozen=True)
class Rival:
    """One explanation: the names that were added to the model (none: nothing is missing), and its fit."""

    names: tuple[str, ...]
    fit: Fit

    @property
    def title(self) -> str:
        """In words."""
        return " + ".join(self.names) or "nothing missing"


def rivals_of(d: Diagnosis) -> tuple[Rival, ...]:
    """The diagnosis' own explanation first, then what stands against it, best first; empty where nothing was searched.

    After a tie these are the explanations that fit as well. After any other verdict: the formula found, and the candidates that
    came closest, each in the place of what was accepted last, or beside nothing.
    """
    found = d.found
    if found is None:
        return ()
    problem, first = found.problem, Rival(found.accepted, found.fit)
    effects = _effects(d)
    if d.formula is not None and not found.rivals:
        return (first, Rival((*found.accepted, FORMULA), d.formula.fit))
    sets: Iterable[tuple[str, ...]] = found.rivals or _nearest(found)
    others = [Rival(names, refitted(problem, found.fit, names, effects)) for names in sets]
    others.sort(key=lambda rival: float(rival.fit.held_out.sum()))
    return (first, *others[: (MOST_TIED if found.rivals else MOST) - 1])


def contests_of(d: Diagnosis, rivals: Sequence[Rival]) -> tuple[tuple[int, int], ...]:
    """Which rivals an experiment should hold against each other: all after a tie, else the accepted one against every other."""
    pairs = tuple(combinations(range(len(rivals)), 2))
    tied = d.found is not None and bool(d.found.rivals)
    return pairs if tied else tuple(pair for pair in pairs if pair[0] == 0)


def refitted(problem: Problem, fit: Fit, names: Sequence[str], effects: Mapping[str, Effect]) -> Fit:
    """The fit's model with exactly these of ``effects`` in it (whatever else it has stays), fitted to the problem.

    What comes new is first fitted under the noise of the model without it: under the small noise of a good model, one that
    is far off pulls on nothing.
    """
    model = fit.model
    had = [active.effect.name for active in model.effects]
    for name in had:
        if name in effects and name not in names:
            model = model.without(name)
    new = [name for name in names if name not in had]
    for name in new:
        loose = problem_for(problem.predictor, model)
        model = fit_with(loose, loose.fit(model), effects[name]).model
    return problem.fit(model)


def without_last(found: Found) -> Model:
    """The accepted model without what was accepted last: what an explanation's worth is measured from."""
    return found.fit.model.without(found.accepted[-1]) if found.accepted else found.nominal.model


def _nearest(found: Found, most: int = MOST - 1) -> list[tuple[str, ...]]:
    """Sets of the same size as the accepted one (or of one name), with the candidates that earned most beside those accepted."""
    kept = found.accepted[:-1]
    step = found.steps[len(kept)] if len(kept) < len(found.steps) else found.steps[-1]
    close = [c.name for c in step.ranking if c.name not in found.accepted and not c.veto and c.evidence.gain > 0]
    return [(*kept, name) for name in close[:most]]


def _effects(d: Diagnosis) -> dict[str, Effect]:
    """Every effect that an explanation may name: the catalogue and what was tried beside it."""
    assert d.found is not None
    base = {active.effect.name for active in d.found.nominal.model.effects}
    tried = [a.effect for step in d.found.steps for c in step.ranking for a in c.fit.model.effects]
    every = {**all_effects(), **{effect.name: effect for effect in tried}}
    return {name: effect for name, effect in every.items() if name not in base}
