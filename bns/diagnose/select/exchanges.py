"""What might do the work of an accepted effect: each of them exchanged for every other effect, one at a time."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import partial

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.estimate.starts import best_start, fit_extended, on_either_side
from bns.diagnose.parallel import each
from bns.diagnose.predict.base import Predictor
from bns.diagnose.select.extending import lone_of, simple
from bns.diagnose.select.result import SelectionStep
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect

SCREEN = DEFAULTS.select.screen
BEHIND = DEFAULTS.select.behind
BEHIND_LOSS = DEFAULTS.select.behind_loss


@dataclass(frozen=True)
class Entry:
    """A round in which an effect came in: the problem and the fit before it, what was accepted then, and the round."""

    problem: Problem
    base: Fit
    accepted: tuple[str, ...]
    step: SelectionStep

    def of(self, name: str, accepted: Collection[str]) -> bool:
        """Did ``name`` come in then, beside what else is accepted now?"""
        return name == self.step.selected and {*self.accepted, name} == set(accepted)

    @property
    def fits(self) -> dict[str, Fit]:
        """Of every candidate of the round."""
        return {c.name: c.fit for c in self.step.ranking}


class Exchanges:
    """Fits with one accepted effect exchanged; those of the problem and the set that were asked for last are kept.

    ``catalogue``, ``worth``: the search's own, which it may change.
    """

    def __init__(
        self,
        predictor: Predictor,
        catalogue: Mapping[str, Effect],
        worth: Mapping[str, Effect],
        tick: Callable[[str], None],
    ) -> None:
        self._predictor, self._catalogue, self._worth, self._tick = predictor, catalogue, worth, tick
        self.entry: Entry | None = None
        """The round in which the last effect came in: what could stand in its place was tried then."""
        self._known: tuple[Problem, tuple[str, ...], list[tuple[str, str, Fit]]] | None = None
        self._longer: tuple[Problem, tuple[str, ...], list[tuple[str, str, Fit]], Fit] | None = None

    def forget(self) -> None:
        """Begin another search, with another model or other effects; what the last round tried still serves."""
        self._known = self._longer = None

    def of(self, problem: Problem, fit: Fit, accepted: tuple[str, ...]) -> list[tuple[str, str, Fit]]:
        """Every accepted effect exchanged for every other one that might do the same."""
        if self._known is not None and self._known[0] is problem and self._known[1] == accepted:
            return self._known[2]
        result = []
        for name in accepted:
            others = simple(self._catalogue, self._worth.values(), accepted)
            entry = self.entry if self.entry and self.entry.of(name, accepted) else None
            if entry and self._predictor.screening is None:  # tried already, when it was chosen among them
                loose, lacking, known = entry.problem, entry.base, entry.fits
            else:
                model, known = fit.model.without(name), {}
                loose = problem_for(self._predictor, model)
                lacking = loose.fit(model)
            reached = loose.loss(fit.model)
            fits = each(partial(self._in_place, problem, fit, loose, lacking, reached, known), others)
            result += [(name, e.name, tried) for e, tried in zip(others, fits, strict=True) if tried is not None]
        self._known = (problem, accepted, result)
        return result

    def longer(self, problem: Problem, fit: Fit, accepted: tuple[str, ...]) -> list[tuple[str, str, Fit]]:
        """The accepted effect exchanged for each that extends one which could nearly stand in its place; from that one's fit.

        Only for those with no more numbers: more have to be earned in a step forwards. Friction that acts more on one wheel is no
        small step from friction that slides under the robot; from friction of both wheels it is.
        """
        if self._longer is not None and self._longer[0] is problem and self._longer[1] == accepted:
            return self._longer[2]
        numbers = {a.effect.name: len(a.effect.parameters) for a in fit.model.effects}
        lone = [e for e in lone_of(self._worth.values(), fit, accepted) if len(e.parameters) <= max(numbers[n] for n in accepted)]
        near = self.of(problem, fit, accepted) if lone else []
        steps = [
            (name, effect, tried)
            for effect in lone
            for name, other, tried in near
            if other == effect.extends and len(effect.parameters) <= numbers[name]
        ]

        def extended(step: tuple[str, Effect, Fit]) -> Fit:
            self._tick(step[1].name)
            return fit_extended(problem, step[2], step[1])

        found = [(step[0], step[1].name, fitted) for step, fitted in zip(steps, each(extended, steps), strict=True)]
        self._longer = (problem, accepted, found, fit)
        return found

    def fitted(self, problem: Problem, fit: Fit, gone: str, name: str) -> Fit | None:
        """The fit with that effect in the place of ``gone``, if it was worked out by `longer` for this problem and this model."""
        if self._longer is None or self._longer[0] is not problem or self._longer[3] is not fit:
            return None
        return next((tried for one, other, tried in self._longer[2] if (one, other) == (gone, name)), None)

    def _in_place(
        self,
        problem: Problem,
        fit: Fit,
        loose: Problem,
        lacking: Fit,
        reached: float,
        known: Mapping[str, Fit],
        effect: Effect,
    ) -> Fit | None:
        """The fit with the effect in the place of one that was taken away (``lacking``); None if it does too little of its work.

        First under the noise of the model without either (``loose``): under the small noise of a good model, one that is far off
        pulls on nothing. ``reached``: the loss there with what was taken away; ``known``: fits there.
        """
        fitted = known.get(effect.name)
        if fitted is None:
            start = best_start(loose, lacking, effect)
            if lacking.loss - start.loss < SCREEN * (lacking.loss - reached):
                return None
            self._tick(effect.name)
            fitted = on_either_side(loose, loose.fit(start.model, nearby=start.jacobian_by_parameter), effect)
        if fitted.loss - reached > max(BEHIND * (lacking.loss - reached), BEHIND_LOSS):
            return None
        return problem.fit(fitted.model, nearby=fit.jacobian_by_parameter)
