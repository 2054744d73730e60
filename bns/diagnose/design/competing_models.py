"""Explanations that an experiment should tell apart, each fitted to the same tracks under the same noise."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from bns.diagnose.design.planned import delays_of
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.select.known_effects import known_effects
from bns.diagnose.select.result import SelectionResult
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.values import numbers_of
from bns.physics.effect import Effect
from bns.physics.model import Model

MOST = DEFAULTS.design.most_models
MOST_TIED = DEFAULTS.design.most_tied_models


@dataclass(frozen=True)
class CompetingModel:
    """One explanation: the names that were added to the model (none: nothing is missing), and its fit."""

    names: tuple[str, ...]
    fit: Fit

    @property
    def title(self) -> str:
        """In words."""
        return " + ".join(self.names) or "nothing missing"

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects that were added."""
        return tuple(active.effect for active in self.fit.model.effects if active.effect.name in self.names)


def competing_models_of(d: Diagnosis) -> tuple[CompetingModel, ...]:
    """The diagnosis' own explanation first, then what stands against it, best first; empty where nothing was searched.

    After a tie these are the explanations that fit as well. After any other verdict: the formula found, and the candidates that
    came closest, each in the place of what was accepted last, or beside nothing.
    """
    selection = d.selection
    if selection is None:
        return ()
    problem, first = selection.problem, CompetingModel(selection.accepted, selection.fit)
    effects = _effects(d)
    if d.formula is not None and not selection.competing_models:
        return (first, CompetingModel((*selection.accepted, d.formula.name), d.formula.fit))
    sets: Iterable[tuple[str, ...]] = selection.competing_models or _nearest(selection)
    others = [CompetingModel(names, refitted(problem, selection.fit, names, effects)) for names in sets]
    others.sort(key=lambda competitor: float(competitor.fit.held_out.sum()))
    return (first, *others[: (MOST_TIED if selection.competing_models else MOST) - 1])


def with_exact_delays(
    problem: Problem, models: Sequence[CompetingModel]
) -> tuple[Problem, tuple[CompetingModel, ...]]:
    """The same explanations, fitted where the delays of all of them are exact; as they are without any, or of a body.

    A delay that ends inside a step of the grid is predicted a little wrongly. Two explanations that are the same, a late command
    and a late clock, then have other numbers of all effects that they share, too, and differ wherever these matter most.
    """
    delays_s, predictor = delays_of(model.fit.model for model in models), problem.predictor
    if not delays_s or not isinstance(predictor, WheelPredictor):
        return problem, tuple(models)
    predictor = predictor.exact_for(delays_s)
    exact = Problem(predictor, problem.pose_filter, predictor.counted)
    return exact, tuple(CompetingModel(model.names, exact.fit(model.fit.model)) for model in models)


@dataclass(frozen=True)
class Rival:
    """An explanation that fits as well as the one that was accepted: its effects, and their parameters as fitted."""

    names: tuple[str, ...]
    numbers: Mapping[str, Mapping[str, Mapping[str, Any]]]

    def as_json(self) -> dict[str, Any]:
        """Plain values: ``effects`` and ``parameters`` as those of a diagnosis."""
        return {"effects": list(self.names), "parameters": self.numbers}


def rivals_of(d: Diagnosis) -> tuple[Rival, ...]:
    """Of a tie, the best first; none after any other verdict."""
    if d.verdict != "tie":
        return ()
    fitted = [(other.names, numbers_of(other.fit)) for other in competing_models_of(d)[1:]]
    return tuple(Rival(names, {n: numbers[n] for n in names if n in numbers}) for names, numbers in fitted)


def model_pairs_of(d: Diagnosis, competing_models: Sequence[CompetingModel]) -> tuple[tuple[int, int], ...]:
    """Which models an experiment should hold against each other: all after a tie, else the accepted one against every other."""
    pairs = tuple(combinations(range(len(competing_models)), 2))
    tied = d.selection is not None and bool(d.selection.competing_models)
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


def without_last(selection: SelectionResult) -> Model:
    """The accepted model without what was accepted last: what an explanation's worth is measured from."""
    return selection.fit.model.without(selection.accepted[-1]) if selection.accepted else selection.nominal.model


def _nearest(selection: SelectionResult, most: int | None = None) -> list[tuple[str, ...]]:
    """Sets of the same size as the accepted one (or of one name), with the candidates that earned most beside those accepted."""
    kept = selection.accepted[:-1]
    step = selection.steps[len(kept)] if len(kept) < len(selection.steps) else selection.steps[-1]
    close = [
        c.name
        for c in step.ranking
        if c.name not in selection.accepted and not c.rejected_because and c.paired_comparison.elpd_diff > 0
    ]
    return [(*kept, name) for name in close[: MOST - 1 if most is None else most]]


def _effects(d: Diagnosis) -> dict[str, Effect]:
    """Every effect that an explanation may add to the model."""
    assert d.selection is not None
    base = {active.effect.name for active in d.selection.nominal.model.effects}
    return {name: effect for name, effect in known_effects(d.selection).items() if name not in base}
