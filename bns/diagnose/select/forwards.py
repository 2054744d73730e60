"""A step forwards of a search: the best of all candidates that earns its place, whose fit has settled, and that is believed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.plausibility import implausible
from bns.diagnose.estimate.problem import settled_problem
from bns.diagnose.estimate.starts import fit_extended, fit_with
from bns.diagnose.parallel import each
from bns.diagnose.predict.base import Predictor
from bns.diagnose.select.acceptance import Acceptance
from bns.diagnose.select.exchanges import Exchanges
from bns.diagnose.select.extending import extended, fits_better, moved_in_chain, simple, to_extend, variant
from bns.diagnose.select.indistinguishable import indistinguishable
from bns.diagnose.select.negligible import certainly_better
from bns.diagnose.select.result import Candidate, SelectionStep
from bns.diagnose.select.screening import screened, worth_a_fit
from bns.diagnose.settings import DEFAULTS
from bns.physics.decoys import DECOYS
from bns.physics.effect import Effect
from bns.physics.model import Model

BEHIND = DEFAULTS.select.behind
MOST = DEFAULTS.select.most_effects
SIMPLE_FIRST = DEFAULTS.select.simple_first
CURVE_FROM = DEFAULTS.select.curve_from


def _best_of_each(tried: Sequence[Candidate]) -> list[Candidate]:
    """Of candidates of the same name the one that gains the most on held-out trials."""
    best = {c.name: c for c in sorted(tried, key=lambda c: c.paired_comparison.elpd_diff)}
    return list(best.values())


def accepted_with(accepted: tuple[str, ...], step: SelectionStep, fit: Fit) -> tuple[str, ...]:
    """What is accepted after a step that ended in ``fit``: an effect that it moved in the chain goes by its name there."""
    there = {active.effect.name: active.effect for active in fit.model.effects}
    kept = [name for name in accepted if name != step.instead_of]
    return (*(n if n in there else next((e.name for e in there.values() if n in e.parts), n) for n in kept), step.selected)


class Forwards:
    """Which effect comes in next, of ``worth`` or, where all are fitted, of ``catalogue``; beside decoys, which set a threshold.

    ``catalogue``, ``worth``: the search's own, which it may change. ``alone``, ``curve_does_better``: as of the search.
    """

    def __init__(
        self,
        predictor: Predictor,
        given: Model,
        catalogue: Mapping[str, Effect],
        worth: dict[str, Effect],
        exchanges: Exchanges,
        acceptance: Acceptance,
        tick: Callable[[str], None],
        alone: Callable[[Candidate], None],
        curve_does_better: Callable[[Problem, Fit, Fit], bool],
    ) -> None:
        self._predictor, self._catalogue, self._worth, self._tick = predictor, catalogue, worth, tick
        self._exchanges, self._acceptance = exchanges, acceptance
        self._alone, self._curve_does_better = alone, curve_does_better
        self.given = given
        """The model that the search begins with, which it may change."""

    def next_step(self, problem: Problem, fit: Fit, accepted: tuple[str, ...]) -> tuple[SelectionStep, Problem, Fit]:
        """A step forwards; none beside several effects where a curve does better than it, and than all that could follow it.

        The list lacks what is missing then. Of several effects the next one alone may do less than a curve.
        """
        forwards = self._forward_step(problem, fit, accepted)
        step = forwards[0]
        if not step.selected or len(accepted) < CURVE_FROM:
            return forwards
        added = next(c.fit for c in step.ranking if c.name == step.selected)
        if not self._curve_does_better(problem, fit, added):
            return forwards
        there = accepted_with(accepted, step, forwards[2])
        ahead = problem.fit(self._looked_ahead(*forwards[1:], there))
        if not self._curve_does_better(problem, fit, ahead):
            return forwards
        return replace(step, selected="", instead_of=""), problem, fit

    def _looked_ahead(self, problem: Problem, fit: Fit, accepted: tuple[str, ...]) -> Model:
        """With as many effects as a search accepts, one after the other; none is exchanged, and none extends another."""
        while len(accepted) < MOST:
            tried, decoy_threshold = self._with_decoys(problem, fit, self._worth_a_fit(problem, fit, accepted), {})
            step, problem, fit = self._chosen(problem, fit, tried, decoy_threshold, {}, 0)
            if not step.selected:
                break
            accepted = (*accepted, step.selected)
        return fit.model

    def _forward_step(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...]
    ) -> tuple[SelectionStep, Problem, Fit]:
        """The best candidate that earns its place and is believed once noise and numbers have settled; what it ends in.

        Where there is none, the best of those that extend an effect which does nothing by itself here.
        """
        left = self._worth_a_fit(problem, fit, accepted)
        place = to_extend(self._worth.values(), fit, accepted, lambda: self._exchanges.of(problem, fit, accepted))
        tried, decoy_threshold = self._with_decoys(problem, fit, [*left, *(self._worth[name] for name in place)], place)
        tried = _best_of_each([*tried, *self._beside_moved(problem, fit, accepted, left)])
        of = len(self._catalogue) - len(accepted) if self._predictor.screening is not None else 0
        chosen = self._chosen(problem, fit, tried, decoy_threshold, place, of)
        lone = [effect for effect in self._worth.values() if effect.extends and effect.name not in (*accepted, *place)]
        if chosen[0].selected or not lone:
            return chosen
        first, tried = chosen[0], each(partial(self._tried, problem, fit, {}), lone)
        step, problem, fit = self._chosen(problem, fit, tried, decoy_threshold, {}, of)
        ranking = sorted((*first.ranking, *step.ranking), key=lambda c: -c.paired_comparison.elpd_diff)
        passed_over = step.passed_over or first.passed_over
        return replace(step, ranking=tuple(ranking), passed_over=passed_over), problem, fit

    def _beside_moved(
        self, problem: Problem, fit: Fit, accepted: tuple[str, ...], effects: Sequence[Effect]
    ) -> list[Candidate]:
        """Each effect that acts between the places of an accepted one, beside that one at its other place (`moved_in_chain`)."""
        if self._predictor.screening is not None:  # a fit takes too long
            return []
        moved = moved_in_chain(self._catalogue, problem, fit, accepted)
        parted = [(one.fit, effect) for one in moved for effect in effects if one.parted_by(effect)]

        def added(to: tuple[Fit, Effect]) -> Candidate:
            self._tick(to[1].name)
            return self._acceptance.candidate(problem, fit, fit_with(problem, *to), to[1].name)

        return each(added, parted)

    def _with_decoys(
        self, problem: Problem, fit: Fit, effects: Sequence[Effect], place: Mapping[str, tuple[str, Fit]]
    ) -> tuple[list[Candidate], float]:
        """The effects as candidates, and what the best of the decoys gains."""
        tried = each(partial(self._tried, problem, fit, place), [*DECOYS, *effects])
        return tried[len(DECOYS) :], max(c.paired_comparison.elpd_diff for c in tried[: len(DECOYS)])

    def _chosen(
        self,
        problem: Problem,
        fit: Fit,
        tried: Sequence[Candidate],
        decoy_threshold: float,
        place: Mapping[str, tuple[str, Fit]],
        of: int,
    ) -> tuple[SelectionStep, Problem, Fit]:
        """The best candidate that earns its place; one that takes another's (``place``) must lower the error, too.

        So must all that gain less than such a one that lowers none: they would only do a part of what it does.
        """
        if self._predictor.screening is not None:
            tried = self._worked_out(problem, fit, tried)
        ranking = sorted(tried, key=lambda c: -c.paired_comparison.elpd_diff)
        passed_over: list[Candidate] = []
        none_lower = False
        for index, candidate in enumerate(ranking):
            gone = place.get(candidate.name, ("",))[0]
            moved = bool(gone) and gone in extended(self._catalogue, candidate.name) and variant(self._catalogue, candidate.name)
            if not (fits_better(fit, candidate.fit) if moved else self._acceptance.earned(candidate, fit, decoy_threshold)):
                continue
            if self._waits(candidate, place, ranking, fit, decoy_threshold):
                continue
            if self._acceptance.refused(candidate):
                passed_over += [candidate] if implausible(candidate.fit, candidate.name, bounds=False) else []
                continue
            settled = settled_problem(self._predictor, candidate.fit.model, problem.pose_filter.noise)
            lower = moved or not (gone or none_lower) or certainly_better((problem, fit), settled)
            if not lower or (gone and not moved and not self._acceptance.needed(*settled, candidate.name)):
                none_lower |= not lower
                continue
            rejected_because = self._acceptance.rejected(settled[1], candidate.name, bounds=False)
            if not rejected_because:
                better = next((p.name for p in passed_over if not indistinguishable(candidate.fit, p.fit, fit)), "")
                return SelectionStep(tuple(ranking), decoy_threshold, candidate.name, better, of, gone), *settled
            ranking[index] = replace(candidate, rejected_because=rejected_because)
            passed_over.append(ranking[index])
        best = passed_over[0].name if passed_over else ""
        return SelectionStep(tuple(ranking), decoy_threshold, "", best, of), problem, fit

    def _waits(
        self,
        candidate: Candidate,
        place: Mapping[str, tuple[str, Fit]],
        ranking: Sequence[Candidate],
        before: Fit,
        decoy_threshold: float,
    ) -> bool:
        """Whether what takes another's place gives way to a simpler one, which it extends, beside that other.

        Friction in the gears is a lag and a friction. Where a friction was accepted, the lag alone comes first if it gains nearly
        as much: the friction beside it may still prove to be of one wheel, or of a cold robot.
        """
        gone, parts = place.get(candidate.name, ("",))[0], extended(self._catalogue, candidate.name)
        if not gone or gone in {*parts, *self._catalogue[candidate.name].contains}:
            return False
        least = SIMPLE_FIRST * candidate.paired_comparison.elpd_diff
        simpler = (c for c in ranking if c.name in parts and c.name not in place and not self._acceptance.refused(c))
        nearly = (c for c in simpler if c.paired_comparison.elpd_diff >= least)
        return any(self._acceptance.earned(c, before, decoy_threshold) for c in nearly)

    def _worth_a_fit(self, problem: Problem, fit: Fit, accepted: tuple[str, ...]) -> list[Effect]:
        """What is fitted beside the accepted effects: where fits are costly, all that the screening ever found promising."""
        if self._predictor.screening is not None:
            self._tick("screening")
            left = [effect for name, effect in self._catalogue.items() if name not in accepted]
            self._worth |= {effect.name: effect for effect in worth_a_fit(screened(problem, fit, left))}
        return simple(self._catalogue, self._worth.values(), accepted)

    def _worked_out(self, problem: Problem, fit: Fit, tried: Sequence[Candidate]) -> list[Candidate]:
        """Where models are worked out roughly: those that come near the best one worked out well, each at its own numbers.

        The curves between which a rough answer is read are of uneven quality, and only like can be compared with like.
        """
        best = max((fit.loss - c.fit.loss for c in tried), default=0.0)
        out = []
        for candidate in tried:
            if fit.loss - candidate.fit.loss >= BEHIND * best > 0 and self._predictor.anchor(candidate.fit.model):
                again = Problem(self._predictor, problem.pose_filter, self._predictor.counted)
                out.append(self._acceptance.candidate(again, fit, again.fit(candidate.fit.model), candidate.name))
            else:
                out.append(candidate)
        return out

    def _tried(self, problem: Problem, fit: Fit, place: Mapping[str, tuple[str, Fit]], effect: Effect) -> Candidate:
        self._tick(effect.name)
        extends = place.get(effect.name)
        known = self._exchanges.fitted(problem, fit, extends[0], effect.name) if extends else None
        if known is not None:
            added = known
        elif extends:
            given = any(active.effect.name == extends[0] for active in self.given.effects)
            added = fit_extended(problem, extends[1], effect, given)
        else:
            added = fit_with(problem, fit, effect)
        found = self._acceptance.candidate(problem, fit, added, effect.name)
        given_alone = {a.effect.name for a in fit.model.effects} <= {a.effect.name for a in self.given.effects}
        if given_alone and effect.name in self._catalogue:
            self._alone(found)
        return found
