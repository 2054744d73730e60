"""Which effects are missing: forwards while a step earns something on held-out trials, with a look back after each.

Guards: decoys set a bar, the chance of a false alarm is shared out over the whole catalogue, a number at a bound
or beyond what is plausible is a veto with its reason.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Fit, Problem
from bns.diagnose.estimate.noise import estimate_noise, filter_for
from bns.diagnose.estimate.parallel import each
from bns.diagnose.estimate.significance import MIN_Z, Evidence
from bns.diagnose.estimate.starts import best_start, fit_with, listed
from bns.diagnose.estimate.trial_clock_test import OwnClocks, judged, own_clocks, with_one_clock
from bns.diagnose.predict.base import Predictor
from bns.diagnose.select.indistinguishable import alike
from bns.diagnose.select.plausibility import veto_of
from bns.physics.decoys import DECOYS
from bns.physics.effect import Effect
from bns.physics.model import Model

FALSE_ALARM = 0.05
"""Chance of any false alarm over the whole catalogue."""
MIN_GAIN = 0.001
"""Least gain that counts, as a share of the loss: honest robots vary by fractions of a percent from trial to trial."""
SCREEN = 0.15
"""An effect is tried in another one's place if its best start alone does this share of the other's work ..."""
BEHIND, BEHIND_LOSS = 0.5, 20.0
"""... and no longer if, fitted, it leaves more than this share of that work undone, and more than this loss: three
standard errors, were it noise alone."""
CLOCKS_CHANCE = 0.01
"""Chance of a false alarm about clocks that differ from trial to trial."""
MOST = 6
"""Effects that a search accepts at most."""


@dataclass(frozen=True)
class Candidate:
    """One effect added to a model: its fit, what it earned on held-out trials, and why it may not be taken."""

    name: str
    fit: Fit
    evidence: Evidence
    veto: str = ""


@dataclass(frozen=True)
class Step:
    """One round: all candidates, best first, the bar that the decoys set, and what was taken ("" for nothing)."""

    ranking: tuple[Candidate, ...]
    bar: float
    taken: str


@dataclass(frozen=True)
class Found:
    """The end of a search: accepted names in order, their fit, the rounds, and explanations of the same size that fit as well."""

    problem: Problem
    nominal: Fit
    fit: Fit
    accepted: tuple[str, ...]
    steps: tuple[Step, ...]
    rivals: tuple[tuple[str, ...], ...] = ()


class Search:
    """A search for the effects that ``model`` lacks, on the tracks of a predictor."""

    def __init__(
        self,
        predictor: Predictor,
        model: Model,
        extra: Mapping[str, Effect] | None = None,
        tick: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.predictor, self.model, self.tick = predictor, model.arranged(), tick
        self._extra = extra
        self.catalogue = listed(self.model, extra)
        self._exchanged: tuple[Problem, tuple[str, ...], list[tuple[str, str, Fit]]] | None = None
        self.level = FALSE_ALARM / max(len(self.catalogue), 1)

    def run(self) -> Found:
        """The search; again with a clock for each trial where these differ, since that hides what else is wrong."""
        plain = self._searched()
        clocks = own_clocks(plain.problem, plain.fit)
        if clocks is None or not self._clocks_earned(clocks, plain.fit):
            return plain
        given = self.model
        self.model = self._bare_with_clocks(clocks.fit.model, given)
        added = self.catalogue.pop(_differing(self.model), None)
        self._exchanged = None
        found = self._searched()
        still = judged(found.problem, found.problem.fit(with_one_clock(found.fit.model)), found.fit)
        if still is None or not self._clocks_earned(still, found.fit):
            return plain
        return self._with_clocks(found, found.problem.fit(given), clocks, added)

    @staticmethod
    def _bare_with_clocks(fitted: Model, given: Model) -> Model:
        """The model as given and the trials' clocks, without what the first search added."""
        kept = {active.effect.name for active in given.effects} | {_differing(fitted)}
        return replace(fitted, effects=tuple(a for a in fitted.effects if a.effect.name in kept))

    def _clocks_earned(self, clocks: OwnClocks, before: Fit) -> bool:
        """Few trials may earn all of it, so no number of standard errors is asked for: the clocks of most may be right."""
        e = clocks.evidence
        return e.p_value < CLOCKS_CHANCE and e.gain > MIN_GAIN * float(before.held_out.mean())

    def _with_clocks(self, found: Found, nominal: Fit, clocks: OwnClocks, added: Effect | None) -> Found:
        """The search's end with the clocks named first, where the model given had none."""
        name = _differing(self.model)
        candidate = Candidate(name, clocks.fit, clocks.evidence)
        first = replace(found.steps[0], ranking=(candidate, *found.steps[0].ranking))
        names = (name,) if added else ()
        return replace(
            found,
            nominal=nominal,
            accepted=(*names, *found.accepted),
            steps=(first, *found.steps[1:]),
            rivals=tuple((*names, *r) for r in found.rivals),
        )

    def _searched(self) -> Found:
        """Forwards and back until nothing more is earned; then rivals of the same size."""
        problem, nominal = self._settled(self.model)
        if nominal.free:
            problem, nominal = self._settled(nominal.model, problem.following.noise)
        fit = nominal
        accepted: tuple[str, ...] = ()
        steps: list[Step] = []
        tried: set[frozenset[str]] = set()
        while len(accepted) < MOST:
            step, problem, fit = self._round(problem, fit, accepted)
            steps.append(step)
            if not step.taken:
                break
            accepted = (*accepted, step.taken)
            problem, fit, accepted = self._swapped(problem, fit, accepted)
            problem, fit, accepted = self._looked_back(problem, fit, accepted)
            if frozenset(accepted) in tried:
                break
            tried.add(frozenset(accepted))
        rivals = self._rivals(problem, fit, accepted)
        simplest = min(rivals, key=lambda r: len(r[1].free), default=None)
        if simplest is not None and len(simplest[1].free) < len(fit.free):
            rivals = [(accepted, fit), *(r for r in rivals if r is not simplest)]
            accepted, fit = simplest
        return Found(problem, problem.fit(self.model), fit, accepted, tuple(steps), tuple(names for names, _ in rivals))

    def _settled(self, model: Model, start: Array | None = None) -> tuple[Problem, Fit]:
        """Noise and numbers that belong together."""
        problem = problem_for(self.predictor, model, start)
        return problem, problem.fit(model)

    def _round(self, problem: Problem, fit: Fit, accepted: tuple[str, ...]) -> tuple[Step, Problem, Fit]:
        """The best candidate that earns its place and is believed once noise and numbers have settled; what it ends in."""
        left = [effect for name, effect in self.catalogue.items() if name not in accepted]
        tried = each(partial(self._tried, problem, fit), [*DECOYS, *left])
        bar = max(c.evidence.gain for c in tried[: len(DECOYS)])
        ranking = sorted(tried[len(DECOYS) :], key=lambda c: -c.evidence.gain)
        for place, candidate in enumerate(ranking):
            if candidate.veto or not self._earned(candidate, fit, bar):
                continue
            settled = self._settled(candidate.fit.model, problem.following.noise)
            veto = veto_of(settled[1], candidate.name, bounds=False)
            if not veto:
                return Step(tuple(ranking), bar, candidate.name), *settled
            ranking[place] = replace(candidate, veto=veto)
        return Step(tuple(ranking), bar, ""), problem, fit

    def _tried(self, problem: Problem, fit: Fit, effect: Effect) -> Candidate:
        self.tick(effect.name)
        added = fit_with(problem, fit, effect)
        return Candidate(effect.name, added, problem.evidence(fit, added), veto_of(added, effect.name))

    def _earned(self, candidate: Candidate, before: Fit, bar: float) -> bool:
        e = candidate.evidence
        least = MIN_GAIN * float(before.held_out.mean())
        return e.p_value < self.level and e.z > MIN_Z and e.gain > max(bar, least)

    def _swapped(self, problem: Problem, fit: Fit, accepted: tuple[str, ...]) -> tuple[Problem, Fit, tuple[str, ...]]:
        """Exchange an accepted effect for one that has earned its place too, while that makes the held-out loss smaller."""
        barred: set[str] = set()
        for _ in range(len(accepted) if len(accepted) > 1 else 0):
            best, new, comes = fit, accepted, ""
            for name, other, tried in self._exchanges(problem, fit, accepted):
                better = other not in barred and tried.held_out.sum() < best.held_out.sum() - 0.5
                if better and self._may_stay(problem, tried, other):
                    best, new, comes = tried, tuple(other if a == name else a for a in accepted), other
            if new == accepted:
                break
            exchanged, settled = self._settled(best.model, problem.following.noise)
            if any(veto_of(settled, name, bounds=False) for name in new):  # under its own noise it asks for more
                barred.add(comes)
            else:
                problem, fit, accepted = exchanged, settled, new
        return problem, fit, accepted

    def _looked_back(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...]
    ) -> tuple[Problem, Fit, tuple[str, ...]]:
        """Drop what no longer earns its place, and what can no longer be believed beside what came in."""
        newest = accepted[-1]
        for name in accepted:
            believed = not veto_of(fit, name, bounds=False)  # at a bound it may be: what does nothing there earns nothing
            if believed and name == newest:
                continue
            lacking = without(problem, fit, name)
            if not believed or not self._earned_over(problem, lacking, fit, name):
                accepted = tuple(a for a in accepted if a != name)
                problem, fit = self._settled(lacking.model, problem.following.noise)
        return problem, fit, accepted

    def _may_stay(self, problem: Problem, fit: Fit, name: str) -> bool:
        """Whether that effect of a fit would be taken as a newcomer: few trials that gain much do not bring one in."""
        return not veto_of(fit, name) and self._earned_over(problem, without(problem, fit, name), fit, name)

    def _earned_over(self, problem: Problem, lacking: Fit, fit: Fit, name: str) -> bool:
        return self._earned(Candidate(name, fit, problem.evidence(lacking, fit)), lacking, 0.0)

    def _exchanges(self, problem: Problem, fit: Fit, accepted: tuple[str, ...]) -> list[tuple[str, str, Fit]]:
        """Every accepted effect exchanged for every other one that might do the same."""
        if self._exchanged is not None and self._exchanged[0] is problem and self._exchanged[1] == accepted:
            return self._exchanged[2]
        found = []
        for name in accepted:
            model = fit.model.without(name)
            loose = problem_for(self.predictor, model)
            lacking, reached = loose.fit(model), loose.loss(fit.model)
            others = [effect for other, effect in self.catalogue.items() if other not in accepted]
            fits = each(partial(self._in_place, problem, fit, loose, lacking, reached), others)
            found += [(name, e.name, tried) for e, tried in zip(others, fits, strict=True) if tried is not None]
        self._exchanged = (problem, accepted, found)
        return found

    def _in_place(
        self, problem: Problem, fit: Fit, loose: Problem, lacking: Fit, reached: float, effect: Effect
    ) -> Fit | None:
        """The fit with the effect in the place of one that was taken away (``lacking``); None if it does too little of its work.

        First under the noise of the model without either (``loose``): under the small noise of a good model, one that is far off
        pulls on nothing. ``reached``: the loss there with what was taken away.
        """
        start = best_start(loose, lacking, effect)
        if lacking.loss - start.loss < SCREEN * (lacking.loss - reached):
            return None
        self.tick(effect.name)
        fitted = loose.fit(start.model, known=start.slopes)
        if fitted.loss - reached > max(BEHIND * (lacking.loss - reached), BEHIND_LOSS):
            return None
        return problem.fit(fitted.model, known=fit.slopes)

    def _rivals(self, problem: Problem, fit: Fit, accepted: tuple[str, ...]) -> list[tuple[tuple[str, ...], Fit]]:
        """Explanations of the same size, one effect exchanged, that these tracks cannot tell from the accepted one.

        What comes in must have earned its place: where trials disagree, much that earns nothing certain is no worse for certain.
        """
        rivals: list[tuple[tuple[str, ...], Fit]] = []
        lacking = cache(partial(without, problem, fit))
        for name, other, tried in self._exchanges(problem, fit, accepted):
            # at a bound it may be: a tether from ever farther away is a slope
            may = not veto_of(tried, other, bounds=False) and self._earned_over(problem, lacking(name), tried, other)
            if may and alike(tried, fit, lacking(name)):
                rivals.append((tuple(other if a == name else a for a in accepted), tried))
        return rivals


def _differing(model: Model) -> str:
    return model.differing.effect.name if model.differing else ""


def without(problem: Problem, fit: Fit, name: str) -> Fit:
    """The fit that lacks an effect."""
    return problem.fit(fit.model.without(name), known=fit.slopes)


def problem_for(predictor: Predictor, model: Model, start: Array | None = None) -> Problem:
    """The problem of fitting models like this one: its noise is estimated under it."""
    steps = predictor.steps(model)
    return Problem(predictor, filter_for(predictor, steps, estimate_noise(predictor, steps, start)))
